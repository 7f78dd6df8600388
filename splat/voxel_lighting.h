// What lamps do to voxels, wherever their values and what gets through to them come from.
#pragma once

#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/camera.h"
#include "base/light.h"
#include "base/placement.h"

namespace freevoxel {

/// Linear RGB, 65535 standing for VoxelLighting::scale().
struct LightValue {
  uint16_t red, green, blue, unused;
};
static_assert(sizeof(LightValue) == 8);

/// Ambient light, and every lamp's times what gets through to the voxel times its shading. Not for Lighting::unlit().
class VoxelLighting {
 public:
  static constexpr float kUnit = 65535.0f;

  /// Throws InputError for lighting that makes no sense.
  VoxelLighting(const Placement& placement, const Lighting& lighting, const Camera& camera);

  /// The largest channel that light can reach, 1 if there is none: radiance is the sum times this.
  float scale() const { return scale_; }
  /// Whether gradients matter.
  bool shaded() const { return lighting_.shading != Shading::none; }
  const Lighting& lighting() const { return lighting_; }

  /// `voxels`: index positions of the finest level. `gradients`: change of value per shortest voxel edge as a share of
  /// the value range, in world axes; empty unless shaded(). `passed`: share of each lamp's light that gets through,
  /// 0..1, lamp after lamp. `lights`: the result. From many threads.
  void light(std::span<const glm::dvec3> voxels, std::span<const glm::vec3> gradients, std::span<const float> passed,
             std::span<LightValue> lights) const;

 private:
  /// A voxel as shading sees it.
  struct Facing {
    glm::dvec3 world{0.0};
    glm::vec3 towardsEye{0.0f};
    Surface surface;
  };
  Facing facing(glm::dvec3 voxel, glm::vec3 gradient) const;
  float shadeBy(size_t lamp, const Facing& facing) const;

  Lighting lighting_;
  Camera camera_;
  glm::dmat4 worldFromIndex_;
  glm::dvec3 towardsOrthographicEye_;
  std::vector<glm::dvec3> directions_;  ///< unit vectors towards directional lamps
  float scale_ = 1.0f;
  bool dark_ = false;  ///< no light at all
};

}  // namespace freevoxel
