// The .dat headers of Voreen and Inviwo: a few lines that describe a raw file.
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isDatHeader(const FileStart& start);

/// Throws InputError with the line.
Payload readDatHeader(const FileStart& start, const VolumeOptions& options);

}  // namespace freevoxel
