// Which blocks have something to draw, and where in them.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "hierarchy/value_grid.h"
#include "volume/transfer_function.h"

namespace freevoxel {

/// A block of edge^3 voxels of one level in which, or within a cell of which, a cell is visible.
struct VisibleBlock {
  glm::ivec3 origin{0};  ///< first voxel of the level, a multiple of the edge
  /// Places (shaders/shared/cell_segment.h) outside which no part of a ray that the block owns can see anything:
  /// origin <= low < high <= origin + edge.
  glm::ivec3 low{0}, high{0};
  int level = 0;
  uint64_t visibleCells = 0;  ///< whose lower corner lies in the block; from a file, visible voxels, and of coarser
                              ///< levels those of stored bricks
};

/// In the order of the Hilbert curve.
std::vector<VisibleBlock> findVisibleBlocks(const ValueGrid& grid, const TransferFunction& transfer, int edge);

}  // namespace freevoxel
