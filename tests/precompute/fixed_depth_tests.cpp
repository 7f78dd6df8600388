// Sums of depths and the bytes that they become.
#include "precompute/fixed_depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "precompute/sweep_kernels.h"
#include "tests/precompute/instruction_sets.h"
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
    ASSERT_LE(std::abs(double(attenuationCode(FixedDepth(depth))) - exact), 0.5 + 0.038) << depth;
  }
}

TEST(AttenuationCode, ends) {
  EXPECT_EQ(attenuationCode(0), 255);
  EXPECT_EQ(attenuationCode(1u << 24), 127);  // 127.5
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

/// Sweeps rows of depths one plane further through nothing, which leaves them as they are.
TEST(AttenuationCode, rowsAreLikeSingleDepthsForAllDepthsAndInstructionSets) {
  constexpr int kWidth = 1 << 12, kStride = kWidth + 2 * kRowUnit;
  std::vector<FixedDepth> depths(size_t(kStride) * kRunEdge), nothing(size_t(kStride) * kRunEdge);
  std::vector<uint8_t> bytes(size_t(kWidth) * kRunEdge), wanted(kWidth / kRowUnit, 1);
  Tile tile;
  tile.terms.own = nothing.data() + kRowUnit;
  tile.state = depths.data() + kRowUnit;
  tile.stride = kStride;
  tile.width = kWidth;
  tile.wanted = wanted.data();
  tile.planeCount = 1;
  tile.planes[0].bytes = bytes.data();
  for (const int64_t target : test::instructionSets()) {
    const test::InstructionSet chosen(target);
    // A8 is made of the upper 16 of 28 bits; the lower ones must make no difference.
    for (uint32_t next = 0; next <= uint32_t(kLargestCodedDepth);) {
      std::vector<FixedDepth> expected;
      for (int row = 0; row < kRunEdge; ++row) {
        for (int x = 0; x < kWidth; ++x, ++next)
          expected.push_back(tile.state[row * kStride + x] = std::min(next << 12 | (next * 37 & 0xfff), 0x0fffffffu));
      }
      sweepTile(tile);
      for (size_t row = 0; row < kRunEdge; ++row) {
        for (size_t x = 0; x < kWidth; ++x) {
          const FixedDepth depth = expected[row * kWidth + x];
          ASSERT_EQ(tile.state[row * kStride + x], depth);
          ASSERT_EQ(bytes[4 * (x - x % 4) + 4 * row + x % 4], attenuationCode(depth))
              << depth << ' ' << hwy::TargetName(target);
        }
      }
    }
  }
}

}  // namespace
}  // namespace freevoxel
