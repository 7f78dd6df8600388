// The rays of an image's pixels in the index space of a volume.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/camera.h"
#include "base/placement.h"
#include "shaders/shared/cell_segment.h"

namespace freevoxel {

using shared::PixelRay;
static_assert(sizeof(PixelRay) == 40 && offsetof(PixelRay, sLow) == 24 && offsetof(PixelRay, axisAndSide) == 36,
              "the shaders read rays at these offsets");

/// One ray per pixel, row 0 first. Rays that miss the volume's box are empty.
std::vector<PixelRay> pixelRays(const Placement& placement, glm::ivec3 dims, const Camera& camera);

/// The same for those pixels of `rays`, which has one per pixel, that lie in the tiles wanted: squares of kRayTile
/// pixels, row 0 first, 0 = not wanted. Others are left as they are.
inline constexpr int kRayTile = 32;
void pixelRays(const Placement& placement, glm::ivec3 dims, const Camera& camera, std::span<const uint8_t> tiles,
               std::span<PixelRay> rays);

}  // namespace freevoxel
