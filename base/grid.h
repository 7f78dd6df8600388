// Sizes of boxes of voxels, overflow checked.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>

namespace freevoxel {

/// Largest number of voxels along one axis that any part of freevoxel accepts: 63-bit Hilbert indices need at most
/// 21 bits an axis.
inline constexpr int kMaxDim = 1 << 21;

/// dims.x * dims.y * dims.z; every component must lie in 0..kMaxDim (then the product fits 63 bits).
inline uint64_t voxelCount(glm::ivec3 dims) {
  return uint64_t(dims.x) * uint64_t(dims.y) * uint64_t(dims.z);
}

/// Whether every component lies in 1..kMaxDim.
inline bool validDims(glm::ivec3 dims) {
  return dims.x >= 1 && dims.y >= 1 && dims.z >= 1 && dims.x <= kMaxDim && dims.y <= kMaxDim && dims.z <= kMaxDim;
}

/// a * b, or nothing if it does not fit 64 bits.
inline std::optional<uint64_t> checkedProduct(uint64_t a, uint64_t b) {
  uint64_t product = 0;
  if (__builtin_mul_overflow(a, b, &product)) return std::nullopt;
  return product;
}

/// a + b, or nothing if it does not fit 64 bits.
inline std::optional<uint64_t> checkedSum(uint64_t a, uint64_t b) {
  uint64_t sum = 0;
  if (__builtin_add_overflow(a, b, &sum)) return std::nullopt;
  return sum;
}

/// Position of voxel p in an array of `dims` voxels with x fastest.
inline uint64_t linearIndex(glm::ivec3 p, glm::ivec3 dims) {
  return (uint64_t(p.z) * uint64_t(dims.y) + uint64_t(p.y)) * uint64_t(dims.x) + uint64_t(p.x);
}

}  // namespace freevoxel
