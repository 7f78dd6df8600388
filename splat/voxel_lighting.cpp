#include "splat/voxel_lighting.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

VoxelLighting::VoxelLighting(const Placement& placement, const Lighting& lighting, const Camera& camera)
    : lighting_(lighting),
      camera_(camera),
      worldFromIndex_(placement.worldFromIndex()),
      towardsOrthographicEye_(glm::normalize(camera.eye - camera.target)) {
  checkLighting(lighting);
  glm::vec3 largest(lighting.ambient);
  for (const Light& light : lighting.lights) {
    directions_.push_back(light.directional ? glm::normalize(light.world) : glm::dvec3(0.0));
    largest += light.linear * largestShade(lighting.shading);
  }
  scale_ = std::max({largest.x, largest.y, largest.z});
  dark_ = !(scale_ > 0.0f);
  if (dark_) scale_ = 1.0f;
}

VoxelLighting::Facing VoxelLighting::facing(glm::dvec3 voxel, glm::vec3 gradient) const {
  Facing facing;
  facing.world = glm::dvec3(worldFromIndex_ * glm::dvec4(voxel, 1.0));
  const glm::dvec3 toEye = camera_.orthographicHeight ? towardsOrthographicEye_ : camera_.eye - facing.world;
  const double distance = glm::length(toEye);
  if (!(distance > 0.0)) return facing;
  facing.towardsEye = glm::vec3(toEye / distance);
  facing.surface = surfaceFacing(gradient, facing.towardsEye);
  return facing;
}

float VoxelLighting::shadeBy(size_t lamp, const Facing& facing) const {
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

void VoxelLighting::light(std::span<const glm::dvec3> voxels, std::span<const glm::vec3> gradients,
                          std::span<const float> passed, std::span<LightValue> lights) const {
  checkEqual(passed.size(), lighting_.lights.size() * voxels.size(), "voxels' light, lamp after lamp");
  checkEqual(lights.size(), voxels.size(), "lit voxels");
  if (dark_) {
    std::fill(lights.begin(), lights.end(), LightValue{0, 0, 0, 0});
    return;
  }
  const float perScale = 1.0f / scale_;
  for (size_t i = 0; i < voxels.size(); ++i) {
    const Facing face = shaded() ? facing(voxels[i], gradients[i]) : Facing{};
    glm::vec3 sum(lighting_.ambient);
    for (size_t lamp = 0; lamp < lighting_.lights.size(); ++lamp) {
      const float share = shaded() ? shadeBy(lamp, face) : 1.0f;
      sum += lighting_.lights[lamp].linear * (passed[lamp * voxels.size() + i] * share);
    }
    const glm::vec3 value = glm::clamp(sum * perScale, 0.0f, 1.0f) * kUnit + 0.5f;
    lights[i] = {uint16_t(value.r), uint16_t(value.g), uint16_t(value.b), 0};
  }
}

}  // namespace freevoxel
