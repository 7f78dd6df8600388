// Sums of depths and the bytes that they become.
#include "precompute/fixed_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "volume/transfer_function.h"

namespace freevoxel {
namespace {

TEST(FixedDepth, sumsSaturate) {
  EXPECT_EQ(saturatingSum(0, 0), 0u);
  EXPECT_EQ(saturatingSum(3, 4), 7u);
  EXPECT_EQ(saturatingSum(0xffffffffu, 0), 0xffffffffu);
  EXPECT_EQ(saturatingSum(0xfffffff0u, 0xfu), 0xffffffffu);
  EXPECT_EQ(saturatingSum(0xfffffff0u, 0x10u), 0xffffffffu);
  EXPECT_EQ(saturatingSum(0xffffffffu, 0xffffffffu), 0xffffffffu);
}

TEST(FixedDepth, sumsDoNotDependOnTheirOrder) {
  std::mt19937 random(7);
  for (int i = 0; i < 1000; ++i) {
    const FixedDepth a = random(), b = random(), c = random();
    ASSERT_EQ(saturatingSum(saturatingSum(a, b), c), saturatingSum(a, saturatingSum(b, c)));
    ASSERT_EQ(saturatingSum(a, b), saturatingSum(b, a));
  }
}

TEST(FixedDepth, opaqueVoxelIsTwelveLog2) {
  EXPECT_EQ(fixedDepth(0.0), 0u);
  EXPECT_EQ(fixedDepth(kLargestExtinction), 12u << 24);
  EXPECT_EQ(fixedDepth(std::log(2.0)), 1u << 24);
}

TEST(AttenuationCode, isTheNearestCodeToWithinItsStatedError) {
  for (uint64_t depth = 0; depth <= 0xffffffffu; depth += 499) {
    const double exact = 255.0 * std::exp2(-double(depth) / kDepthUnitsPerLog2);
    ASSERT_LE(std::abs(double(attenuationCode(FixedDepth(depth))) - exact), 0.5 + 0.0045) << depth;
  }
}

TEST(AttenuationCode, ends) {
  EXPECT_EQ(attenuationCode(0), 255);
  EXPECT_EQ(attenuationCode(1u << 24), 128);  // 127.5
  EXPECT_EQ(attenuationCode(8u << 24), 1);    // 0.996
  EXPECT_EQ(attenuationCode(9u << 24), 0);    // 0.498
  EXPECT_EQ(attenuationCode(0xffffffffu), 0);
}

TEST(AttenuationCode, neverRisesWithDepth) {
  uint8_t previous = 255;
  for (uint64_t depth = 0; depth < uint64_t(10) << 24; depth += 16) {
    const uint8_t code = attenuationCode(FixedDepth(depth));
    ASSERT_LE(code, previous);
    previous = code;
  }
}

/// Rows shorter, equal to and longer than any vector register, at odd addresses.
TEST(FixedDepth, rowsAreLikeSingleDepths) {
  std::mt19937 random(3);
  for (size_t count = 0; count < 70; ++count) {
    std::vector<FixedDepth> next(count + 1), segments(count + 1), sums(count + 2, 1234u);
    for (FixedDepth& depth : next)
      depth = random() >> (random() % 12);
    for (FixedDepth& depth : segments)
      depth = random() >> (random() % 12);
    std::vector<uint8_t> codes(count + 2, 99);
    addDepths(next.data() + 1, segments.data() + 1, count, sums.data() + 1);
    attenuationCodes(next.data() + 1, count, codes.data() + 1);
    for (size_t i = 1; i <= count; ++i) {
      ASSERT_EQ(sums[i], saturatingSum(next[i], segments[i]));
      ASSERT_EQ(codes[i], attenuationCode(next[i]));
    }
    EXPECT_EQ(sums.front(), 1234u);
    EXPECT_EQ(sums.back(), 1234u);
    EXPECT_EQ(codes.front(), 99);
    EXPECT_EQ(codes.back(), 99);
  }
}

TEST(AttenuationCode, rowsAreLikeSingleDepthsEverywhere) {
  std::vector<FixedDepth> depths;
  for (uint64_t depth = 0; depth < uint64_t(20) << 24; depth += 61)
    depths.push_back(FixedDepth(depth));
  std::vector<uint8_t> codes(depths.size());
  attenuationCodes(depths.data(), depths.size(), codes.data());
  for (size_t i = 0; i < depths.size(); ++i)
    ASSERT_EQ(codes[i], attenuationCode(depths[i])) << depths[i];
}

}  // namespace
}  // namespace freevoxel
