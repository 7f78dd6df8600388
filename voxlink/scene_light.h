// Lamps as rays through a scene see them.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "base/image.h"
#include "base/light.h"
#include "base/placement.h"
#include "voxlink/scene_voxels.h"
#include "voxlink/shadows.h"

namespace freevoxel {

/// A lamp in voxels.
struct SceneLamp {
  bool directional = false;
  glm::vec3 place{0.0f};  ///< or the unit vector towards it
  glm::vec3 linear{0.0f};
};

std::vector<SceneLamp> sceneLamps(const SceneGrid& grid, const Lighting& lighting);

/// Where voxel centres are, for what knows volumes only.
inline Placement placementOf(const SceneGrid& grid) {
  Placement placement;
  placement.spacing = glm::dvec3(grid.edge);
  placement.origin = glm::dvec3(grid.origin) + 0.5 * grid.edge;
  return placement;
}

/// Light is added up per pixel in whole numbers, whose order does not matter: multiples of 1 / scale, a power of two
/// such that the brightest pixel that lamps can make fits.
float sumScale(const Lighting& lighting);
/// Of the light that leaves the scene behind a pixel, which alpha lacks.
inline constexpr float kEscapeScale = 16777216.0f;  // 2^24

/// Four sums of a pixel: red, green, blue, what escapes.
Image picture(const std::vector<uint32_t>& sums, const Lighting& lighting, glm::ivec2 size);

}  // namespace freevoxel
