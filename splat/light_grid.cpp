#include "splat/light_grid.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/first_exception.h"

namespace freevoxel {

namespace {

/// Lights some voxels of a grid at a time.
class Lamps {
 public:
  Lamps(const ValueGrid& grid, const AttenuationFile* file, const VoxelLighting& lighting,
        std::span<const LampAttenuation> attenuations, LightGrid& result)
      : grid_(grid),
        file_(file),
        lighting_(lighting),
        attenuations_(attenuations),
        result_(result),
        gradientFromIndex_(gradientFromDifferences(grid)) {}

  /// `brick`: the one whose curve `voxels` follow, or null. Voxels outside the volume are skipped.
  void light(std::span<const glm::ivec3> voxels, const BrickView* brick) const {
    std::vector<glm::dvec3> places(voxels.begin(), voxels.end());
    std::vector<glm::vec3> gradients;
    if (lighting_.shaded()) {
      for (const glm::ivec3& voxel : voxels)
        gradients.push_back(outside(voxel) ? glm::vec3(0.0f) : gradientFromIndex_ * indexGradient(grid_, voxel));
    }
    std::vector<float> passed(attenuations_.size() * voxels.size());
    for (size_t lamp = 0; lamp < attenuations_.size(); ++lamp) {
      const LampAttenuation& attenuation = attenuations_[lamp];
      const auto ofLamp = std::span(passed).subspan(lamp * voxels.size(), voxels.size());
      if (attenuation.stored) {
        attenuation.stored->look(*brick, ofLamp);
      } else if (attenuation.pin) {
        std::vector<uint16_t> pinned(voxels.size());
        file_->pinned().unpack(*attenuation.pin, brick->origin / brick->edge, pinned);
        for (size_t i = 0; i < voxels.size(); ++i)
          ofLamp[i] = float(pinned[i]) * (1.0f / AttenuationGrid::kUnit);
      } else {
        for (size_t i = 0; i < voxels.size(); ++i) {
          if (!outside(voxels[i]))
            ofLamp[i] =
                float(attenuation.grid->values[linearIndex(voxels[i], grid_.dims)]) * (1.0f / AttenuationGrid::kUnit);
        }
      }
    }
    std::vector<LightValue> lights(voxels.size());
    lighting_.light(places, gradients, passed, lights);
    for (size_t i = 0; i < voxels.size(); ++i) {
      if (!outside(voxels[i])) result_.values[linearIndex(voxels[i], grid_.dims)] = lights[i];
    }
  }

 private:
  bool outside(glm::ivec3 voxel) const {
    return voxel.x >= grid_.dims.x || voxel.y >= grid_.dims.y || voxel.z >= grid_.dims.z;
  }

  const ValueGrid& grid_;
  const AttenuationFile* file_;
  const VoxelLighting& lighting_;
  std::span<const LampAttenuation> attenuations_;
  LightGrid& result_;
  glm::mat3 gradientFromIndex_;
};

}  // namespace

LightGrid lightGrid(const ValueGrid& grid, const VisibleCubes& cubes, const AttenuationFile* file,
                    const Lighting& lighting, const Camera& camera, std::span<const LampAttenuation> attenuations) {
  checkLighting(lighting);
  checkEqual(attenuations.size(), lighting.lights.size(), "lamps and their attenuations");
  LightGrid result;
  if (lighting.unlit()) return result;
  const VoxelLighting voxelLighting(grid.placement, lighting, camera);
  result.scale = voxelLighting.scale();
  result.values.resize(grid.codes.size());
  const Lamps lamps(grid, file, voxelLighting, attenuations, result);
  if (file != nullptr) {
    const auto lightBrick = [&](size_t b) {
      DirectionSet directions = 0;
      for (const LampAttenuation& attenuation : attenuations) {
        if (attenuation.stored) directions |= attenuation.stored->directions(file->brickOrigin(b));
      }
      const BrickView brick = file->brick(b, directions);
      std::vector<glm::ivec3> voxels;
      voxels.reserve(brick.curve.size());
      for (const LocalPosition& local : brick.curve)
        voxels.push_back(brick.origin + glm::ivec3(local.x, local.y, local.z));
      lamps.light(voxels, &brick);
      file->checkIntact();
    };
    FirstException failure;
#pragma omp parallel for schedule(dynamic, 4)
    for (int64_t b = 0; b < int64_t(file->brickCount()); ++b)
      failure.guard([&] { lightBrick(size_t(b)); });
    failure.rethrow();
    return result;
  }
  constexpr int kEdge = 1 << VisibleCubes::kShift;
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t i = 0; i < int64_t(cubes.visible.size()); ++i) {
    if (cubes.visible[size_t(i)] == 0) continue;
    const glm::ivec3 cube(int(i % cubes.dims.x), int(i / cubes.dims.x % cubes.dims.y),
                          int(i / (int64_t(cubes.dims.x) * cubes.dims.y)));
    std::vector<glm::ivec3> voxels;
    voxels.reserve(size_t(kEdge) * kEdge * kEdge);
    for (int n = 0; n < kEdge * kEdge * kEdge; ++n)
      voxels.push_back(cube * kEdge + glm::ivec3(n % kEdge, n / kEdge % kEdge, n / (kEdge * kEdge)));
    lamps.light(voxels, nullptr);
  }
  return result;
}

}  // namespace freevoxel
