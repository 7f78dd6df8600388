// How the curve runs through cells of 4^3 voxels, in the form that whole cells are permuted by.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "precompute/hilbert.h"

namespace freevoxel {

/// Edge and number of the voxels whose attenuations are permuted at once: one run of the curve, one line of the cache.
/// (Not a cell in the sense of splatting.)
inline constexpr int kRunEdge = 4;
inline constexpr int kRunVoxels = kRunEdge * kRunEdge * kRunEdge;

/// Order of the 64 voxels of a run for one state of the curve. A voxel's source place is x + 4 * (y + 4 * z).
struct RunOrder {
  alignas(64) std::array<uint8_t, kRunVoxels> source;  ///< source place of each step along the curve
  /// The same in two stages: octants of 2^3 in curve order, as (y / 2 * 2 + x / 2) + 4 * (z / 2) ...
  std::array<uint8_t, 8> octants;
  /// ... then, for each step, the place among the 16 voxels of two successive octants: within one it is
  /// (x & 1) + 2 * (y & 1) + 4 * (z & 1).
  alignas(64) std::array<uint8_t, kRunVoxels> within;
};

/// 0 <= state < kHilbertStateCount.
const RunOrder& runOrder(int state);

/// One run of a brick.
struct BrickRun {
  uint32_t firstStep;     ///< along the curve inside the brick, a multiple of 64
  const RunOrder* order;  ///< of its voxels
};

/// The runs of a brick of 2^brickOrder voxels an edge, 2 <= brickOrder <= 5, at x + n * (y + n * z) with n runs an
/// edge.
std::span<const BrickRun> brickRuns(int state, int brickOrder);

}  // namespace freevoxel
