// Light that a run of stored voxels sends to the eye, many voxels at a time (shaders/voxlink/light_voxels.comp is the
// same on the GPU).
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "base/light.h"

namespace freevoxel {

/// Voxels of one brick that follow each other in the fragment buffer, and room for a whole vector more.
struct VoxelRun {
  static constexpr size_t kMost = 512;
  static constexpr size_t kSlack = 16;  ///< 32-bit lanes of the longest vector

  size_t count = 0;                                               ///< up to kMost
  float x[kMost + kSlack], y[kMost + kSlack], z[kMost + kSlack];  ///< places, in voxels
  uint32_t fragments[kMost + kSlack];
  float red[kMost + kSlack], green[kMost + kSlack], blue[kMost + kSlack];
  uint32_t light[kMost + kSlack];  ///< the result, shared::packLight
};

/// A lamp, or the eye: a place in lengths (shortest voxel edges, world axes) from voxel (0,0,0), or, if directional,
/// the unit vector towards it.
struct Beacon {
  bool directional = false;
  glm::vec3 place{0.0f};
};
struct ShadingLamp : Beacon {
  glm::vec3 linear{0.0f};
  const uint8_t* shares = nullptr;  ///< of every fragment
};

struct ShadingFrame {
  Shading shading = Shading::none;
  float ambient = 0.0f;
  Beacon eye;
  std::span<const ShadingLamp> lamps;
  glm::mat3 lengthFromIndex{1.0f};
};

/// Fills run.light. `first`: number of the run's first fragment. What lies in a run behind its end is overwritten.
/// Same bytes with every instruction set.
void shadeRun(const ShadingFrame& frame, size_t first, VoxelRun& run);

}  // namespace freevoxel
