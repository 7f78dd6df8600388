// The light that arrives at every voxel, all lamps together, and leaves for the eye (papers/freevoxels section 4.3).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/camera.h"
#include "base/light.h"
#include "hierarchy/value_grid.h"
#include "splat/attenuation_grid.h"

namespace freevoxel {

/// Linear RGB, 65535 standing for the grid's scale.
struct LightValue {
  uint16_t red, green, blue, unused;
};
static_assert(sizeof(LightValue) == 8);

/// x fastest. Empty: every voxel shines with its own colour, unlit.
struct LightGrid {
  static constexpr float kUnit = 65535.0f;
  std::vector<LightValue> values;
  float scale = 1.0f;  ///< the largest channel that light can reach: radiance is the sum times this

  bool empty() const { return values.empty(); }
};

/// Ambient light, and every lamp's times what the volume lets through to the voxel times its shading. `attenuation`
/// gives the grid towards a lamp. Throws InputError for colours or directions that make no sense.
/// Empty if the lighting is Lighting::unlit().
LightGrid lightGrid(const ValueGrid& grid, const Lighting& lighting, const Camera& camera,
                    const std::function<AttenuationGrid(const Light&)>& attenuation);

}  // namespace freevoxel
