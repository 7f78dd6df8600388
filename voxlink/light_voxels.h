// Light that stored voxels of a volume send to the eye, in plain C++.
#pragma once

#include <cstdint>
#include <vector>

#include "base/camera.h"
#include "base/light.h"
#include "voxlink/buffers.h"
#include "voxlink/shadows.h"

namespace freevoxel {

/// Per fragment, packed (shared::packLight): ambient, and of every lamp its colour times its share times its shading.
/// Shading differs from `render`'s only in that the normal is the stored one. Same bytes for any thread count. `light`
/// is made as long as there are fragments. Throws InputError for colours or directions that make no sense.
void lightVoxels(const VoxLinkBuffers& buffers, const Lighting& lighting, const LightShares& shares,
                 const Camera& camera, std::vector<uint32_t>& light);

}  // namespace freevoxel
