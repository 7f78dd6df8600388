// What lies right before a voxel, traced; what lies beyond, looked up (docs/fidelity.md, "Near field").
#pragma once

#include "splat/attenuation_grid.h"

namespace freevoxel {

/// Planes that are traced before stored attenuation.
inline constexpr int kNearPlanes = 4;

/// Replaces attenuation at every voxel of a visible cube by what the voxel's own ray towards the target loses over the
/// next `planes` planes of voxels along its dominant axis, times attenuation interpolated where it then is; 1 where it
/// has left the volume. A number per voxel cannot follow how attenuation changes within a voxel of a surface; values
/// can. Same values for any thread count.
AttenuationGrid withNearField(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& cubes,
                              const Towards& towards, int planes, const AttenuationGrid& far);

}  // namespace freevoxel
