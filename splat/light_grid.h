// The light that arrives at every voxel, all lamps together, and leaves for the eye (papers/freevoxels section 4.3).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/camera.h"
#include "base/light.h"
#include "hierarchy/value_grid.h"
#include "splat/attenuation_grid.h"
#include "splat/stored_attenuation.h"
#include "splat/voxel_lighting.h"

namespace freevoxel {

/// x fastest. Empty: every voxel shines with its own colour, unlit.
struct LightGrid {
  static constexpr float kUnit = VoxelLighting::kUnit;
  std::vector<LightValue> values;
  float scale = 1.0f;  ///< the largest channel that light can reach: radiance is the sum times this

  bool empty() const { return values.empty(); }
};

/// What the volume lets through towards one lamp: looked up in the attenuation file, a pin of it, or a whole grid.
struct LampAttenuation {
  std::optional<StoredAttenuation> stored;
  std::optional<size_t> pin;
  std::shared_ptr<const AttenuationGrid> grid;  ///< if neither
};

/// Ambient light, and every lamp's times what the volume lets through to the voxel times its shading, in one pass over
/// the voxels that a visible cell touches (what other voxels get does not matter). `attenuations`: one per lamp. `file`
/// may be null if all of them are grids. Empty if the lighting is Lighting::unlit().
LightGrid lightGrid(const ValueGrid& grid, const VisibleCubes& cubes, const AttenuationFile* file,
                    const Lighting& lighting, const Camera& camera, std::span<const LampAttenuation> attenuations);

}  // namespace freevoxel
