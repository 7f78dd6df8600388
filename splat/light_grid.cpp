#include "splat/light_grid.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/first_exception.h"

namespace freevoxel {

namespace {

/// Lights some voxels at a time.
class Lamps {
 public:
  Lamps(const ValueGrid& grid, const AttenuationFile* file, const Lighting& lighting, const Camera& camera,
        std::span<const LampAttenuation> attenuations, LightGrid& result)
      : grid_(grid),
        file_(file),
        lighting_(lighting),
        camera_(camera),
        attenuations_(attenuations),
        result_(result),
        worldFromIndex_(grid.placement.worldFromIndex()),
        gradientFromIndex_(gradientFromDifferences(grid)),
        towardsOrthographicEye_(glm::normalize(camera.eye - camera.target)) {
    for (const Light& light : lighting.lights)
      directions_.push_back(light.directional ? glm::normalize(light.world) : glm::dvec3(0.0));
  }

  /// `brick`: the one whose curve `voxels` follow, or null. Voxels outside the volume are skipped.
  void light(std::span<const glm::ivec3> voxels, const BrickView* brick) const {
    std::vector<glm::vec3> sums(voxels.size(), glm::vec3(lighting_.ambient));
    std::vector<Facing> facings;
    if (lighting_.shading != Shading::none) {
      facings.reserve(voxels.size());
      for (const glm::ivec3& voxel : voxels)
        facings.push_back(facing(voxel));
    }
    std::vector<float> passed(voxels.size());
    for (size_t lamp = 0; lamp < lighting_.lights.size(); ++lamp) {
      const LampAttenuation& attenuation = attenuations_[lamp];
      if (attenuation.stored) {
        attenuation.stored->look(*brick, passed);
      } else if (attenuation.pin) {
        std::vector<uint16_t> pinned(voxels.size());
        file_->pinned().unpack(*attenuation.pin, brick->origin / brick->edge, pinned);
        for (size_t i = 0; i < voxels.size(); ++i)
          passed[i] = float(pinned[i]) * (1.0f / AttenuationGrid::kUnit);
      } else {
        for (size_t i = 0; i < voxels.size(); ++i) {
          if (!outside(voxels[i]))
            passed[i] =
                float(attenuation.grid.values[linearIndex(voxels[i], grid_.dims)]) * (1.0f / AttenuationGrid::kUnit);
        }
      }
      const Light& light = lighting_.lights[lamp];
      for (size_t i = 0; i < voxels.size(); ++i) {
        const float share = facings.empty() ? 1.0f : shadeBy(lamp, facings[i]);
        sums[i] += light.linear * (passed[i] * share);
      }
    }
    const float perScale = 1.0f / result_.scale;
    for (size_t i = 0; i < voxels.size(); ++i) {
      if (outside(voxels[i])) continue;
      const glm::vec3 value = glm::clamp(sums[i] * perScale, 0.0f, 1.0f) * LightGrid::kUnit + 0.5f;
      result_.values[linearIndex(voxels[i], grid_.dims)] = {uint16_t(value.r), uint16_t(value.g), uint16_t(value.b), 0};
    }
  }

 private:
  /// A voxel as shading sees it.
  struct Facing {
    glm::dvec3 world;
    glm::vec3 towardsEye;
    Surface surface;
  };

  bool outside(glm::ivec3 voxel) const {
    return voxel.x >= grid_.dims.x || voxel.y >= grid_.dims.y || voxel.z >= grid_.dims.z;
  }

  Facing facing(glm::ivec3 voxel) const {
    Facing facing;
    if (outside(voxel)) return facing;
    facing.world = glm::dvec3(worldFromIndex_ * glm::dvec4(voxel, 1.0));
    const glm::dvec3 toEye = camera_.orthographicHeight ? towardsOrthographicEye_ : camera_.eye - facing.world;
    const double distance = glm::length(toEye);
    if (!(distance > 0.0)) return facing;
    facing.towardsEye = glm::vec3(toEye / distance);
    facing.surface = surfaceFacing(gradientFromIndex_ * indexGradient(grid_, voxel), facing.towardsEye);
    return facing;
  }

  float shadeBy(size_t lamp, const Facing& facing) const {
    if (facing.surface.share == 0.0f) return 1.0f;
    const Light& light = lighting_.lights[lamp];
    glm::vec3 towardsLight(directions_[lamp]);
    if (!light.directional) {
      const glm::dvec3 toLight = light.world - facing.world;
      const double distance = glm::length(toLight);
      if (!(distance > 0.0)) return 1.0f;
      towardsLight = glm::vec3(toLight / distance);
    }
    return shade(lighting_.shading, facing.surface, towardsLight, facing.towardsEye);
  }

  const ValueGrid& grid_;
  const AttenuationFile* file_;
  const Lighting& lighting_;
  const Camera& camera_;
  std::span<const LampAttenuation> attenuations_;
  LightGrid& result_;
  glm::dmat4 worldFromIndex_;
  glm::mat3 gradientFromIndex_;
  glm::dvec3 towardsOrthographicEye_;
  std::vector<glm::dvec3> directions_;  ///< unit vectors towards directional lamps
};

}  // namespace

LightGrid lightGrid(const ValueGrid& grid, const VisibleCubes& cubes, const AttenuationFile* file,
                    const Lighting& lighting, const Camera& camera, std::span<const LampAttenuation> attenuations) {
  checkLighting(lighting);
  checkEqual(attenuations.size(), lighting.lights.size(), "lamps and their attenuations");
  LightGrid result;
  if (lighting.unlit()) return result;
  glm::vec3 largest(lighting.ambient);
  for (const Light& light : lighting.lights)
    largest += light.linear * largestShade(lighting.shading);
  result.scale = std::max({largest.x, largest.y, largest.z});
  result.values.resize(grid.codes.size());
  if (!(result.scale > 0.0f)) {
    result.scale = 1.0f;
    return result;
  }
  const Lamps lamps(grid, file, lighting, camera, attenuations, result);
  if (file != nullptr) {
    const auto lightBrick = [&](size_t b) {
      DirectionSet directions = 0;
      for (const LampAttenuation& attenuation : attenuations) {
        if (attenuation.stored) directions |= attenuation.stored->directions(b);
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
