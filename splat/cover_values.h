// What voxels of levels from 1 on are interpolated by: opacity (shaders/shared/cell_segment.h).
#pragma once

#include <span>
#include <vector>

#include "shaders/shared/cell_segment.h"
#include "splat/classification_table.h"

namespace freevoxel {

/// `matter`: colour times extinction and extinction of voxels of a level, in log2 per shortest edge of the finest one.
void coverOf(int level, std::span<const TableEntry> matter, std::vector<shared::CoverValue>& cover);

}  // namespace freevoxel
