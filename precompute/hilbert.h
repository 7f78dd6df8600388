// The three-dimensional Hilbert curve (papers/freevoxels section 5).
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace freevoxel {

/// Position of voxel p on the curve through the cube of 2^order voxels an edge; 0 <= p < 2^order, 0 <= order <= 21.
/// Top-down with one fixed start state, so hilbertIndex(p, n) >> 3 == hilbertIndex(p >> 1, n - 1): a parent is found by
/// shifting, and an aligned brick of 2^k voxels an edge is one run of 8^k indices.
uint64_t hilbertIndex(glm::ivec3 p, int order);

/// Inverse of hilbertIndex.
glm::ivec3 hilbertPosition(uint64_t index, int order);

/// Smallest order whose cube holds a box of `dims` voxels.
int hilbertOrder(glm::ivec3 dims);

/// How the curve runs inside a brick depends only on a small state that the brick inherits from above.
inline constexpr int kHilbertStateCount = 12;

/// State of the brick at position `brick` (in bricks) within a cube of 2^order bricks an edge.
int hilbertState(glm::ivec3 brick, int order);

/// A voxel's place inside its brick.
struct LocalPosition {
  uint8_t x, y, z;
};

/// For each step along the curve inside a brick of 2^brickOrder voxels an edge (8^brickOrder of them), where that voxel
/// lies. 0 <= state < kHilbertStateCount, 0 <= brickOrder <= 5. Computed once; lives as long as the program.
std::span<const LocalPosition> hilbertCurve(int state, int brickOrder);

/// The inverse: step along the curve for local position x + edge * (y + edge * z).
std::span<const uint16_t> hilbertSteps(int state, int brickOrder);

}  // namespace freevoxel
