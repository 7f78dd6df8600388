// Volumes and transfer functions that the tests of the attenuation file share.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/vec3.hpp>
#include <mutex>
#include <random>
#include <utility>
#include <vector>

#include "precompute/sweep.h"
#include "volume/transfer_function.h"
#include "volume/volume.h"

namespace freevoxel::test {

/// Calls a function with every slab of a sweep, one at a time.
template <class F>
class FunctionSink final : public AttenuationSink {
 public:
  explicit FunctionSink(F f) : f_(std::move(f)) {}
  void receive(const AttenuationSlab& slab) override {
    const std::lock_guard lock(mutex_);
    f_(slab);
  }
  void complete(int, int) override {}

 private:
  std::mutex mutex_;
  F f_;
};

/// A volume of type T whose values f(x, y, z) gives.
template <class T, class F>
Volume makeVolume(ValueType type, glm::ivec3 dims, F&& f) {
  Volume volume;
  volume.header.dims = dims;
  volume.header.type = type;
  volume.header.placement.spacing = {0.5, 1.25, 2.0};
  volume.header.placement.origin = {-3.0, 10.0, 0.25};
  volume.data.resize(volume.header.bytes());
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x) {
        const T value = f(x, y, z);
        std::memcpy(volume.data.data() + linearIndex({x, y, z}, dims) * sizeof(T), &value, sizeof(T));
      }
    }
  }
  return volume;
}

/// Bytes 0..255; about half of them 0, so that depths stay small enough to be told apart.
inline Volume randomBytes(glm::ivec3 dims, uint32_t seed) {
  std::mt19937 random(seed);
  return makeVolume<uint8_t>(ValueType::u8, dims, [&](int, int, int) {
    const uint32_t bits = random();
    return uint8_t((bits & 256) != 0 ? bits & 255 : 0);
  });
}

/// Nothing below a fifth of the range, then a thin veil, a step, and a ramp to nearly opaque.
inline TransferFunction veilAndRamp(double low = 0.0, double high = 255.0) {
  const double width = high - low;
  TransferFunction transfer;
  transfer.low = low;
  transfer.high = high;
  transfer.points = {{low, {0.0, 0.0, 0.0}, 0.0},
                     {low + 0.2 * width, {0.1, 0.2, 0.3}, 0.0},
                     {low + 0.5 * width, {0.5, 0.4, 0.3}, 0.01},
                     {low + 0.5 * width, {0.9, 0.4, 0.3}, 0.1},
                     {high, {1.0, 1.0, 0.9}, 0.97}};
  return transfer;
}

}  // namespace freevoxel::test
