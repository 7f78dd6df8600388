// The table behind shaders/shared/direction_code.h.
#pragma once

#include <array>
#include <cmath>
#include <glm/vec3.hpp>
#include <numbers>

#include "shaders/shared/scene_voxel.h"

namespace freevoxel {

/// As shared::packDirection reads it: 255 squared cosines with sign, 64 pairs of cosine and sine.
inline const std::array<float, 255 + 2 * 64>& directionTable() {
  static const std::array<float, 255 + 2 * 64> table = [] {
    std::array<float, 255 + 2 * 64> entries{};
    for (size_t i = 0; i < 255; ++i) {
      const double cosine = std::cos((double(i) + 0.5) * std::numbers::pi / 255.0);
      entries[i] = float(cosine * std::abs(cosine));
    }
    for (size_t i = 0; i < 64; ++i) {
      const double angle = (double(i) + 0.5) * std::numbers::pi / 128.0;
      entries[255 + 2 * i] = float(std::cos(angle));
      entries[256 + 2 * i] = float(std::sin(angle));
    }
    return entries;
  }();
  return table;
}

}  // namespace freevoxel

#define DIRECTION_TABLE(i) (::freevoxel::directionTable()[size_t(i)])
#include "shaders/shared/direction_code.h"
