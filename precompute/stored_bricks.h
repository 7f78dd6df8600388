// Which bricks an attenuation file stores.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "volume/code_visibility.h"
#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

struct StoredBrick {
  uint64_t hilbertIndex = 0;   ///< of the brick, see brickCurveOrder
  glm::ivec3 position{0};      ///< voxel / edge
  uint32_t visibleVoxels = 0;  ///< opacity > 0
};

/// Bricks along each axis.
glm::ivec3 brickDims(glm::ivec3 dims, int edge);

/// Voxels of a level along each axis; level 0 is the finest.
glm::ivec3 dimsOfLevel(glm::ivec3 dims, int level);

/// Levels that a volume has until one brick holds it, the finest included.
int mostHierarchyLevels(glm::ivec3 dims, int edge);

/// Order of the curve through the bricks: the smallest cube of 2^order bricks an edge that holds the volume.
int brickCurveOrder(glm::ivec3 dims, int edge);

/// Voxels of the brick that lie inside the volume, along each axis.
glm::ivec3 brickExtent(glm::ivec3 position, glm::ivec3 dims, int edge);

/// Planes that findStoredBricks looks at for slab `slab`, the `slab`-th row of bricks along z: those of the slab and
/// one to either side, inside the volume.
struct PlaneRange {
  int first = 0, last = 0;  ///< first..last-1
};
PlaneRange planesOfSlab(glm::ivec3 dims, int edge, int slab);

/// Bricks that have a corner of a visible cell among their voxels, sorted along the Hilbert curve. A cell, the cube
/// between eight neighbouring voxels (indices clamped at the volume's border), is visible if the largest opacity
/// between the smallest and the largest of its eight decoded values is above 0. So every visible voxel is stored, and
/// so is all that a visible cell interpolates from.
std::vector<StoredBrick> findStoredBricks(std::span<const uint16_t> codes, glm::ivec3 dims, int edge,
                                          const TransferFunction& transfer, const ValueCoding& coding);

/// The bricks of one slab, not sorted. `codes` are those of planesOfSlab() alone.
std::vector<StoredBrick> findStoredBricks(std::span<const uint16_t> codes, glm::ivec3 dims, int edge, int slab,
                                          const CodeVisibility& visibility);

void sortAlongCurve(std::vector<StoredBrick>& bricks);

}  // namespace freevoxel
