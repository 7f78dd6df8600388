// Depths between neighbouring voxels.
#include "precompute/segment_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "tests/precompute/test_volumes.h"

namespace freevoxel {
namespace {

FixedDepth segment(const SegmentDepth& segments, uint16_t code, uint16_t next) {
  FixedDepth depth = 0;
  segments.row({&code, 1}, {&next, 1}, &depth);
  return depth;
}

double naturalDepth(FixedDepth depth) {
  return double(depth) / kDepthUnitsPerLog2 * std::log(2.0);
}

TEST(VoxelSegments, areTheNeighboursOwnDepth) {
  const TransferFunction transfer = test::veilAndRamp();
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  const auto segments = makeSegmentDepth(Classification::voxel, transfer, coding);
  for (uint16_t code = 0; code < 256; ++code) {
    const FixedDepth expected = fixedDepth(transfer.extinctionAt(code));
    ASSERT_EQ(segment(*segments, 0, code), expected);
    ASSERT_EQ(segment(*segments, 255, code), expected);
  }
}

/// Mean extinction between two values by brute force.
double meanExtinction(const TransferFunction& transfer, double a, double b) {
  const int samples = 200000;
  double sum = 0.0;
  for (int i = 0; i < samples; ++i)
    sum += transfer.extinctionAt(a + (b - a) * (i + 0.5) / samples);
  return sum / samples;
}

class PreintegratedSegments : public testing::TestWithParam<ValueType> {
 protected:
  const TransferFunction transfer_ = test::veilAndRamp(0.0, GetParam() == ValueType::u8 ? 255.0 : 3000.0);
  const ValueCoding coding_ = valueCoding(GetParam(), transfer_.low, transfer_.high);
  const std::unique_ptr<SegmentDepth> segments_ = makeSegmentDepth(Classification::preintegrated, transfer_, coding_);
};
INSTANTIATE_TEST_SUITE_P(Types, PreintegratedSegments, testing::Values(ValueType::u8, ValueType::u16, ValueType::f32),
                         [](const auto& type) { return std::string(valueTypeName(type.param)); });

TEST_P(PreintegratedSegments, areTheSameBothWays) {
  std::mt19937 random(5);
  for (int i = 0; i < 10000; ++i) {
    const auto a = uint16_t(random() % (coding_.largest + 1));
    const auto b = uint16_t(random() % (coding_.largest + 1));
    ASSERT_EQ(segment(*segments_, a, b), segment(*segments_, b, a));
  }
}

TEST_P(PreintegratedSegments, betweenEqualValuesAreTheVoxelsOwnDepth) {
  for (uint32_t code = 0; code <= coding_.largest; code += 1 + coding_.largest / 255) {
    ASSERT_EQ(segment(*segments_, uint16_t(code), uint16_t(code)),
              fixedDepth(transfer_.extinctionAt(coding_.decode(code))));
  }
}

TEST_P(PreintegratedSegments, areMeanExtinction) {
  std::mt19937 random(6);
  for (int i = 0; i < 40; ++i) {
    const auto a = uint16_t(random() % (coding_.largest + 1));
    const auto b =
        uint16_t(i % 2 == 0 ? random() % (coding_.largest + 1) : std::min<uint32_t>(a + 1u, coding_.largest));
    const double expected = meanExtinction(transfer_, coding_.decode(a), coding_.decode(b));
    ASSERT_NEAR(naturalDepth(segment(*segments_, a, b)), expected, 1e-5) << a << ' ' << b;
  }
}

TEST(PreintegratedSegment, ofOpaqueAndClearIsNotHalfOpaque) {
  // Opacity 1 - exp(-s) would need a mean of s; the clamped logarithm of a ramp from 0 to 1 has a closed form:
  // the integral of -ln(1 - o) over 0..1 is 1, less a tail beyond 1 - 2^-12 that the clamp cuts off: 2^-12.
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}, {255.0, {}, 1.0}};
  const ValueCoding coding = valueCoding(ValueType::u8, 0.0, 255.0);
  const auto segments = makeSegmentDepth(Classification::preintegrated, transfer, coding);
  EXPECT_NEAR(naturalDepth(segment(*segments, 0, 255)), 1.0 - std::exp2(-12.0), 1e-5);
}

}  // namespace
}  // namespace freevoxel
