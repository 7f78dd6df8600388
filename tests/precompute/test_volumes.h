// Volumes and transfer functions that the tests of the attenuation file share.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/vec3.hpp>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "precompute/hilbert.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
#include "shaders/shared/directions.h"
#include "volume/transfer_function.h"
#include "volume/volume.h"

namespace freevoxel::test {

/// Keeps all planes of all bricks.
class MemorySink final : public AttenuationSink {
 public:
  MemorySink(glm::ivec3 dims, int edge) : dims_(dims), edge_(edge) {
    const glm::ivec3 bricks = brickDims(dims, edge);
    for (auto& pass : slabs_)
      pass.resize(size_t(bricks.z));
    bytes_.resize(voxelCount(bricks) * shared::kDirectionCount * brickBytes() / sizeof(Line));
    uint8_t* next = bytes_.data()->bytes;
    std::memset(next, 77, bytes_.size() * sizeof(Line));
    for (auto& pass : slabs_) {
      for (int z = 0; z < bricks.z; ++z) {
        for (int y = 0; y < bricks.y; ++y) {
          for (int x = 0; x < bricks.x; ++x) {
            const glm::ivec3 position(x, y, z);
            pass[size_t(z)].push_back({position, hilbertState(position, brickCurveOrder(dims, edge)), next});
            next += kDirectionsPerSection * brickBytes();
          }
        }
      }
    }
  }
  std::span<const BrickPlanes> begin(int pass, int slab) override { return slabs_[size_t(pass)][size_t(slab)]; }
  void complete(int /*pass*/, int /*slab*/) override {}

  /// Attenuation of every voxel along one direction, in volume order. `outside` is set to whether all of the bricks
  /// that is outside the volume is 255.
  std::vector<uint8_t> volumeOrder(int direction, bool& outside) const {
    std::vector<uint8_t> result(voxelCount(dims_));
    outside = true;
    for (const auto& slab : slabs_[size_t(sweepPass(direction))]) {
      for (const BrickPlanes& brick : slab) {
        const uint8_t* plane = brick.planes + size_t(direction % kDirectionsPerSection) * brickBytes();
        const auto curve = hilbertCurve(brick.hilbertState, std::countr_zero(unsigned(edge_)));
        for (size_t step = 0; step < curve.size(); ++step) {
          const glm::ivec3 p = brick.position * edge_ + glm::ivec3(curve[step].x, curve[step].y, curve[step].z);
          if (p.x < dims_.x && p.y < dims_.y && p.z < dims_.z) {
            result[linearIndex(p, dims_)] = plane[step];
          } else {
            outside = outside && plane[step] == kAttenuationOutside;
          }
        }
      }
    }
    return result;
  }

 private:
  struct alignas(kBrickPlaneAlignment) Line {
    uint8_t bytes[kBrickPlaneAlignment];
  };
  size_t brickBytes() const { return size_t(edge_) * size_t(edge_) * size_t(edge_); }

  glm::ivec3 dims_;
  int edge_;
  std::vector<Line> bytes_;
  std::array<std::vector<std::vector<BrickPlanes>>, kSweepPasses> slabs_;
};

using Planes = std::array<std::vector<uint8_t>, shared::kDirectionCount>;

/// Attenuation of all voxels in volume order, per direction.
inline Planes sweepAll(std::span<const uint16_t> codes, glm::ivec3 dims, const SegmentDepth& segments, int edge = 16) {
  MemorySink sink(dims, edge);
  StoredCodePlanes planes(codes, dims);
  sweepAttenuation(planes, dims, edge, segments, sink);
  Planes result;
  for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
    bool outside = false;
    result[size_t(direction)] = sink.volumeOrder(direction, outside);
    EXPECT_TRUE(outside);
  }
  return result;
}

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
