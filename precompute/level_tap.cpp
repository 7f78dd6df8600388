#include "precompute/level_tap.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace freevoxel {

namespace {

constexpr size_t kDepths = size_t(1) << 16;

struct Tables {
  std::array<float, kDepths> transmittance;
  std::array<uint8_t, kDepths> code;
  Tables() {
    for (size_t depth = 0; depth < kDepths; ++depth) {
      transmittance[depth] = float(std::exp2(-double(depth) / kLevelDepthUnitsPerLog2));
      code[depth] = attenuationCode(FixedDepth(depth) << 12);
    }
  }
};

const Tables& tables() {
  static const auto kept = std::make_unique<const Tables>();
  return *kept;
}

constexpr int kShift = 12;  // from units of 2^-24 log2 to 2^-12

}  // namespace

float levelTransmittance(LevelDepth depth) {
  return tables().transmittance[depth];
}

uint8_t levelCode(LevelDepth depth) {
  return tables().code[depth];
}

LevelDepth levelDepth(float transmittance) {
  const double depth = -std::log2(std::max(double(transmittance), 0x1p-16)) * kLevelDepthUnitsPerLog2;
  return LevelDepth(std::clamp(depth + 0.5, 0.0, double(kDepths - 1)));
}

void LevelTap::add(const Plane& plane, const float* weights, bool first, bool last, LevelDepth* out) {
  const auto columns = size_t(plane.width + 1) / 2, whole = size_t(plane.width) / 2;
  const auto rows = size_t(plane.rows + 1) / 2;
  if (first) {
    planes_ = 0;
    sums_.assign(columns * rows, 0);
    if (weights != nullptr) {
      weightedSums_.assign(columns * rows, 0.0f);
      weightSums_.assign(columns * rows, 0.0f);
    }
  }
  ++planes_;
  for (size_t y = 0; y < size_t(plane.rows); ++y) {
    const FixedDepth* row = plane.depths + y * plane.stride;
    uint32_t* sums = sums_.data() + y / 2 * columns;
    // At most 8 depths below 2^28 (kLargestKeptDepth).
    for (size_t x = 0; x < whole; ++x)
      sums[x] += row[2 * x] + row[2 * x + 1];
    if (columns > whole) sums[whole] += row[2 * whole];
  }
  if (weights != nullptr) addWeighted(plane, weights);
  if (!last) return;
  for (size_t y = 0; y < rows; ++y) {
    const auto ofRows = uint32_t(std::min(plane.rows - 2 * int(y), 2) * planes_);
    for (size_t x = 0; x < columns; ++x) {
      const size_t i = y * columns + x;
      const uint32_t count = ofRows * (x < whole ? 2 : 1);
      if (weights != nullptr && weightSums_[i] > 0.0f) {
        out[i] = levelDepth(weightedSums_[i] / weightSums_[i]);
      } else {
        const uint32_t mean = count == 8 ? sums_[i] >> 3 : sums_[i] / count;
        out[i] = LevelDepth(std::min((mean + (1u << (kShift - 1))) >> kShift, uint32_t(kDepths - 1)));
      }
    }
  }
}

void LevelTap::addWeighted(const Plane& plane, const float* weights) {
  const auto columns = size_t(plane.width + 1) / 2;
  for (size_t y = 0; y < size_t(plane.rows); ++y) {
    const FixedDepth* row = plane.depths + y * plane.stride;
    const uint16_t* codes = plane.codes + y * size_t(plane.width);
    for (size_t x = 0; x < size_t(plane.width); ++x) {
      const float weight = weights[codes[x]];
      if (weight == 0.0f) continue;
      const size_t i = y / 2 * columns + x / 2;
      weightedSums_[i] += weight * levelTransmittance(LevelDepth(row[x] >> kShift));
      weightSums_[i] += weight;
    }
  }
}

}  // namespace freevoxel
