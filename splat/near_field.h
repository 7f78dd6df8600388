// What lies right before a voxel, traced; what lies beyond, looked up (docs/fidelity.md, "Near field").
#pragma once

#include <span>

#include "splat/attenuation_grid.h"
#include "volume/code_visibility.h"

namespace freevoxel {

/// Planes that are traced before stored attenuation.
inline constexpr int kNearPlanes = 4;

/// Cubes in which the near field is traced: where something is visible between the codes in them and of two voxels
/// around, which are all that pictures look at next to what is visible.
VisibleCubes findNearCubes(const ValueGrid& grid, const CodeVisibility& visibility);

/// Replaces attenuation at every voxel of a near cube by what the voxel's own ray towards the target loses over the
/// next `planes` planes of voxels along its dominant axis, times attenuation interpolated where it then is; 1 where it
/// has left the volume. A number per voxel cannot follow how attenuation changes within a voxel of a surface; values
/// can. Same values for any thread count.
AttenuationGrid withNearField(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& nearCubes,
                              const Towards& towards, int planes, const AttenuationGrid& far);

/// Codes, and attenuation without the near field, of a box of voxels of the volume, x fastest.
struct NearFieldBox {
  glm::ivec3 first{0}, size{0};
  std::span<const uint16_t> codes, far;
};

/// The voxels that the near field of a brick looks at.
NearFieldBox nearFieldBox(glm::ivec3 dims, glm::ivec3 origin, int edge);

/// The same, bit by bit, for one brick of a volume of `dims`, from nearFieldBox() filled: edge^3 attenuations, x
/// fastest, those outside the volume left alone.
void brickNearField(glm::ivec3 dims, const ClassificationTable& table, const CodeVisibility& visibility,
                    const Towards& towards, const NearFieldBox& box, glm::ivec3 origin, int edge,
                    std::span<uint16_t> attenuations);

}  // namespace freevoxel
