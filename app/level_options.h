// Options of levels and of memory, and what pictures drawn with them tell.
#pragma once

#include <CLI/CLI.hpp>

#include "app/session.h"
#include "splat/splat.h"

namespace freevoxel {

/// --lod, --gpu-memory, --memory.
void addLevelOptions(CLI::App& command, SplatOptions& options);

/// Blocks and splats of each level, and what was left out and why.
void reportLevels(const SplatStatistics& statistics, Session& session);

}  // namespace freevoxel
