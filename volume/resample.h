// A volume on a finer or coarser lattice.
#pragma once

#include <glm/vec3.hpp>

#include "volume/volume.h"

namespace freevoxel {

/// Voxels along each axis of a box like `header`'s whose longest edge has `longest` voxels, as near to cubes as whole
/// numbers allow; at least 1 each. longest >= 1.
glm::ivec3 resampledDims(const VolumeHeader& header, int longest);

/// Values at the centres of dims.x * dims.y * dims.z equal parts of the volume's box: trilinear, of the outermost
/// voxels beyond them; the nearest voxel's for labels. Type and box stay; whole numbers are rounded. A NaN spoils what
/// it is mixed into. Throws MachineError before anything is allocated if this machine has not the memory.
Volume resampled(const Volume& volume, glm::ivec3 dims);

}  // namespace freevoxel
