// Part of a picture: several processes trace a band of rows each (DESIGN section 8).
#pragma once

#include <cstdint>

#include "base/camera.h"

namespace freevoxel {

/// Rows first to first + count - 1 of a camera's image; count may be 0.
struct ImageRows {
  int first = 0;
  int count = 0;
};

inline ImageRows allRows(const Camera& camera) {
  return {0, camera.imageSize.y};
}

/// The `part`-th of `parts` bands that are as high as each other, give or take a row.
inline ImageRows bandOfRows(const Camera& camera, int part, int parts) {
  const auto start = [&](int p) { return int(int64_t(camera.imageSize.y) * p / parts); };
  return {start(part), start(part + 1) - start(part)};
}

}  // namespace freevoxel
