#include "splat/pixel_rays.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

namespace {

PixelRay indexRay(glm::dvec3 origin, glm::dvec3 direction, glm::ivec3 dims) {
  const glm::dvec3 size = glm::abs(direction);
  const int a = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const int b = (a + 1) % 3, c = (a + 2) % 3;
  PixelRay ray{};
  double enter = 0.0, leave = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    const double lower = -0.5 - origin[axis], upper = dims[axis] - 0.5 - origin[axis];
    if (direction[axis] == 0.0) {
      if (lower > 0.0 || upper < 0.0) leave = -1.0;
      continue;
    }
    const double t0 = lower / direction[axis], t1 = upper / direction[axis];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  // Less than this moves a ray by nothing along the largest volume there can be.
  constexpr double kLeastSlope = 1e-20;
  const auto slopeOf = [&](int axis) {
    const double slope = direction[axis] / direction[a];
    return std::abs(slope) < kLeastSlope ? 0.0 : slope;
  };
  const double slopeB = slopeOf(b), slopeC = slopeOf(c);
  ray.baseB = float(origin[b] - origin[a] * slopeB);
  ray.baseC = float(origin[c] - origin[a] * slopeC);
  ray.slopeB = float(slopeB);
  ray.slopeC = float(slopeC);
  ray.perSlopeB = slopeB == 0.0 ? 0.0f : float(1.0 / slopeB);
  ray.perSlopeC = slopeC == 0.0 ? 0.0f : float(1.0 / slopeC);
  // The ray's parameter counts shortest voxel edges.
  ray.lengthPerPlane = float(1.0 / std::abs(direction[a]));
  ray.axisAndSide = uint32_t(a) | (direction[a] < 0.0 ? shared::kRayEyeAbove : 0u);
  if (enter < leave) {
    const double s0 = origin[a] + enter * direction[a], s1 = origin[a] + leave * direction[a];
    ray.sLow = float(std::min(s0, s1));
    ray.sHigh = float(std::max(s0, s1));
  }
  return ray;
}

}  // namespace

void pixelRays(const Placement& placement, glm::ivec3 dims, const Camera& camera, std::span<const uint8_t> tiles,
               std::span<PixelRay> rays) {
  const ViewFrame frame = viewFrame(camera);
  const glm::dmat4 indexFromWorld = glm::inverse(placement.worldFromIndex());
  const double unit = placement.unitLength();
  const glm::ivec2 size = camera.imageSize, count = (size + (kRayTile - 1)) / kRayTile;
  checkEqual(rays.size(), size_t(size.x) * size_t(size.y), "rays of an image");
  checkEqual(tiles.size(), size_t(count.x) * size_t(count.y), "tiles of an image");
#pragma omp parallel for schedule(dynamic, 1)
  for (int tile = 0; tile < count.x * count.y; ++tile) {
    if (tiles[size_t(tile)] == 0) continue;
    const glm::ivec2 low = glm::ivec2(tile % count.x, tile / count.x) * kRayTile;
    const glm::ivec2 high = glm::min(low + kRayTile, size);
    for (int y = low.y; y < high.y; ++y) {
      for (int x = low.x; x < high.x; ++x) {
        const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
        rays[size_t(y) * size_t(size.x) + size_t(x)] =
            indexRay(glm::dvec3(indexFromWorld * glm::dvec4(ray.origin, 1.0)),
                     glm::dvec3(indexFromWorld * glm::dvec4(ray.direction * unit, 0.0)), dims);
      }
    }
  }
}

std::vector<PixelRay> pixelRays(const Placement& placement, glm::ivec3 dims, const Camera& camera) {
  const glm::ivec2 count = (camera.imageSize + (kRayTile - 1)) / kRayTile;
  std::vector<PixelRay> rays(size_t(camera.imageSize.x) * size_t(camera.imageSize.y));
  pixelRays(placement, dims, camera, std::vector<uint8_t>(size_t(count.x) * size_t(count.y), 1), rays);
  return rays;
}

}  // namespace freevoxel
