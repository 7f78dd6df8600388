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
TEST(FixedDepth, rowsAreLookedUpLikeSingleCodes) {
  std::mt19937 random(3);
  std::vector<FixedDepth> table(256 * 256);
  for (FixedDepth& depth : table)
    depth = random();
  constexpr uint16_t kFirstVisible = 200;
  for (size_t a = 0; a < kFirstVisible; ++a)
    std::fill_n(table.begin() + ptrdiff_t(a * 256), kFirstVisible, 0);
  for (const int64_t target : test::instructionSets()) {
    const test::InstructionSet chosen(target);
    for (size_t count = 0; count < 70; ++count) {
      std::vector<uint16_t> codes(count + 1), nextCodes(count + 1);
      for (size_t i = 0; i <= count; ++i) {
        codes[i] = uint16_t(count % 2 == 0 ? random() & 255 : random() % kFirstVisible);
        nextCodes[i] = uint16_t(count % 2 == 0 ? random() & 255 : random() % kFirstVisible);
      }
      std::vector<FixedDepth> single(count + 2, 1234u), pairs(count + 2, 1234u);
      lookUpDepths(table.data(), codes.data() + 1, count, single.data() + 1);
      lookUpDepthPairs(table.data(), codes.data() + 1, nextCodes.data() + 1, count, kFirstVisible, pairs.data() + 1);
      for (size_t i = 1; i <= count; ++i) {
        ASSERT_EQ(single[i], table[codes[i]]);
        ASSERT_EQ(pairs[i], table[size_t(codes[i]) * 256 + nextCodes[i]]);
      }
      for (const auto& depths : {single, pairs}) {
        EXPECT_EQ(depths.front(), 1234u);
        EXPECT_EQ(depths.back(), 1234u);
      }
    }
  }
}

TEST(AttenuationCode, rowsAreLikeSingleDepthsForAllDepthsAndInstructionSets) {
  constexpr int kWidth = 1 << 12, kRows = 4;
  std::vector<FixedDepth> depths(size_t(kWidth) * kRows);
  std::vector<uint32_t> words(kWidth);
  const StripPart part{0, kWidth};
  for (const int64_t target : test::instructionSets()) {
    const test::InstructionSet chosen(target);
    // A8 is made of the upper 20 bits; the lower ones must make no difference.
    uint32_t next = 0;
    while (next <= uint32_t(kLargestCodedDepth)) {
      for (FixedDepth& depth : depths) {
        depth = next << 8 | (next * 37 & 0xff);
        ++next;
      }
      codeStrip(depths.data(), kWidth, kRows, kWidth, {&part, 1}, words.data());
      for (size_t i = 0; i < depths.size(); ++i) {
        const auto code = uint8_t(words[i % kWidth] >> (8 * (i / kWidth)));
        ASSERT_EQ(code, attenuationCode(depths[i])) << depths[i] << ' ' << hwy::TargetName(target);
      }
    }
  }
}

}  // namespace
}  // namespace freevoxel
