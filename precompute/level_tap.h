// From depths of the finest level, as they are swept, to those of level 1: no byte in between.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "precompute/fixed_depth.h"

namespace freevoxel {

/// Depths of coarser levels, as -log2 of attenuation in units of 2^-12, saturating just below 16 (as the sweep does).
using LevelDepth = uint16_t;
inline constexpr double kLevelDepthUnitsPerLog2 = 4096.0;

/// 2^-depth, and round(255 * 2^-depth).
float levelTransmittance(LevelDepth depth);
uint8_t levelCode(LevelDepth depth);
/// The depth of a transmittance, 0..1.
LevelDepth levelDepth(float transmittance);

/// Where level 1 of a slab of bricks goes.
struct LevelTarget {
  /// Of each direction of a pass: slab planes of the level, rows of them, x fastest; null: nobody wants them.
  LevelDepth* depths = nullptr;
  /// Of each code, its weight in the mean of attenuation; null: the mean is that of depths, which is geometric of
  /// attenuation (papers/freevoxels Eq. 7).
  const float* weights = nullptr;

  /// Entries of one direction.
  static size_t directionSize(glm::ivec3 dims, int edge) {
    return size_t(edge / 2) * size_t((dims.y + 1) / 2) * size_t((dims.x + 1) / 2);
  }
};

/// Takes the planes of one direction and strip (precompute/sweep_kernels.h), two after the other, and makes one plane
/// of level 1 of them. Voxels outside the volume do not count.
class LevelTap {
 public:
  /// A plane of a strip, or what belongs to it of the plane beside it.
  struct Plane {
    const FixedDepth* depths = nullptr;
    size_t stride = 0;                ///< from row to row of depths
    const uint16_t* codes = nullptr;  ///< rows of `width`; needed if there are weights
    int rows = 0, width = 0;          ///< inside the volume
  };
  /// Starts anew if `first`. Ends with `last`: then `out`, rows of (width + 1) / 2, is filled.
  void add(const Plane& plane, const float* weights, bool first, bool last, LevelDepth* out);

 private:
  void addWeighted(const Plane& plane, const float* weights);

  int planes_ = 0;
  std::vector<uint32_t> sums_;
  std::vector<float> weightedSums_, weightSums_;
};

}  // namespace freevoxel
