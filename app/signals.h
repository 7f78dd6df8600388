// Interruption by the user.
#pragma once

namespace freevoxel {

/// From here on SIGINT and SIGTERM remove half-written files (see base/atomic_file.h) before they end the program.
void cleanUpOnSignals();

}  // namespace freevoxel
