#include "precompute/level_matter.h"

#include <algorithm>
#include <cmath>

namespace freevoxel {

namespace {

/// Less than any transmittance that could be told from it: keeps logarithms finite.
constexpr float kLeastTransmittance = 1e-30f;

}  // namespace

LevelMatter reducedMatter(const std::array<const LevelMatter*, 8>& children, glm::vec3 edges) {
  const float shortest = 2.0f * std::min({edges.x, edges.y, edges.z});
  LevelMatter result;
  float opacities = 0.0f;
  for (const LevelMatter* child : children) {
    if (child == nullptr || child->extinction <= 0.0f) continue;
    const float opacity = -std::expm1(-child->extinction * shortest);
    result.glow += child->glow * (opacity / child->extinction);
    opacities += opacity;
  }
  if (opacities <= 0.0f) return {};
  for (int axis = 0; axis < 3; ++axis) {
    const size_t along = size_t(1) << axis, b = size_t(1) << (axis + 1) % 3, c = size_t(1) << (axis + 2) % 3;
    float transmittance = 0.0f;
    int columns = 0, length = 1;
    for (size_t column = 0; column < 4; ++column) {
      const size_t first = (column & 1 ? b : 0) + (column & 2 ? c : 0);
      if (children[first] == nullptr) continue;
      float depth = children[first]->extinction;
      if (const LevelMatter* second = children[first + along]) {
        depth += second->extinction;
        length = 2;
      }
      transmittance += std::exp(-depth * edges[axis]);
      ++columns;
    }
    const float mean = std::max(transmittance / float(columns), kLeastTransmittance);
    result.extinction = std::max(result.extinction, -std::log(mean) / (float(length) * edges[axis]));
  }
  // `glow` is a sum of colours times opacities so far.
  result.glow *= result.extinction / opacities;
  return result;
}

}  // namespace freevoxel
