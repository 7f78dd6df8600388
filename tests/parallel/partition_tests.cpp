// Which rank draws which block.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <string>

#include "base/error.h"
#include "parallel/partition.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

Partition partition(const std::string& text) {
  Partition result;
  EXPECT_TRUE(parsePartition(text, result)) << text;
  EXPECT_EQ(partitionName(result), text);
  return result;
}

/// Blocks of two levels with awkward work: many alike, some with none, one with most.
std::vector<SharedBlock> manyBlocks() {
  std::vector<SharedBlock> blocks;
  for (int i = 0; i < 1001; ++i)
    blocks.push_back({i % 13 == 0 ? 1 : 0, (i * 37) % 160, uint64_t(i * i % 97 + (i == 500 ? 4000 : 0))});
  return blocks;
}

std::vector<uint64_t> workOf(const std::vector<SharedBlock>& blocks, const std::vector<int>& owners, int rankCount) {
  std::vector<uint64_t> work(static_cast<size_t>(rankCount));
  for (size_t i = 0; i < blocks.size(); ++i)
    work[size_t(owners[i])] += blocks[i].work;
  return work;
}

// Back and forth, so that nobody always has the largest.
TEST(Partition, DealsInTurnLargestFirst) {
  const std::vector<SharedBlock> blocks = {{0, 0, 5}, {0, 0, 9}, {0, 0, 5}, {0, 0, 7}, {0, 0, 1}};
  // In turn: 9, 7, the first 5, the second 5, 1.
  EXPECT_EQ(dealBlocks(blocks, partition("round-robin"), 2), (std::vector<int>{1, 0, 0, 1, 0}));
  EXPECT_EQ(dealBlocks(blocks, partition("round-robin"), 3), (std::vector<int>{2, 0, 2, 1, 1}));
}

TEST(Partition, EveryLevelIsDealtByItself) {
  const std::vector<SharedBlock> blocks = {{0, 0, 9}, {0, 0, 5}, {1, 0, 4}, {1, 0, 3}, {3, 0, 1}};
  EXPECT_EQ(dealBlocks(blocks, partition("round-robin"), 4), (std::vector<int>{0, 1, 0, 1, 0}));
}

TEST(Partition, CutsRunsOfTheCurveAndSlabs) {
  const std::vector<SharedBlock> blocks = {{0, 32, 1}, {0, 0, 1}, {0, 64, 1}, {0, 0, 1}, {0, 32, 1}, {0, 64, 1}};
  EXPECT_EQ(dealBlocks(blocks, partition("hilbert"), 3), (std::vector<int>{0, 0, 1, 1, 2, 2}));
  EXPECT_EQ(dealBlocks(blocks, partition("slab"), 3), (std::vector<int>{1, 0, 2, 0, 1, 2}));
}

TEST(Partition, EveryBlockHasOneOwnerWhateverTheCounts) {
  for (const std::string name : {"round-robin", "hilbert", "slab", "random:1", "random:18446744073709551615"}) {
    for (const int rankCount : {1, 2, 3, 7, 128, 4096}) {
      for (const size_t count : {size_t(0), size_t(1), size_t(1001)}) {
        std::vector<SharedBlock> blocks = manyBlocks();
        blocks.resize(count);
        const std::vector<int> owners = dealBlocks(blocks, partition(name), rankCount);
        ASSERT_EQ(owners.size(), count);
        std::vector<int> seen(count);
        for (int rank = 0; rank < rankCount; ++rank) {
          const std::vector<uint8_t> share = shareOf(owners, rank);
          for (size_t i = 0; i < count; ++i)
            seen[i] += share[i];
        }
        EXPECT_EQ(seen, std::vector<int>(count, 1)) << name << ' ' << rankCount;
      }
    }
  }
}

// Dealt in turn, shares of a level differ by no more than its largest block.
TEST(Partition, InTurnIsFair) {
  std::vector<SharedBlock> blocks = manyBlocks();
  for (SharedBlock& block : blocks)
    block.level = 0;
  for (const int rankCount : {2, 3, 8, 64}) {
    const std::vector<uint64_t> work =
        workOf(blocks, dealBlocks(blocks, partition("round-robin"), rankCount), rankCount);
    const auto [least, most] = std::minmax_element(work.begin(), work.end());
    EXPECT_LE(*most - *least, 4000u + 97u);
  }
}

TEST(Partition, SeedsDifferAndRepeat) {
  const std::vector<SharedBlock> blocks = manyBlocks();
  const std::vector<int> one = dealBlocks(blocks, partition("random:1"), 5);
  EXPECT_EQ(one, dealBlocks(blocks, partition("random:1"), 5));
  EXPECT_NE(one, dealBlocks(blocks, partition("random:2"), 5));
  // Frozen: results of earlier runs must be repeatable.
  EXPECT_EQ(std::vector<int>(one.begin(), one.begin() + 8), (std::vector<int>{1, 2, 1, 0, 2, 4, 1, 1}));
  // Each gets about a fifth: five standard deviations.
  for (int rank = 0; rank < 5; ++rank)
    EXPECT_NEAR(double(std::count(one.begin(), one.end(), rank)), 1001.0 / 5.0, 5.0 * 12.7);
}

TEST(Partition, FileSaysWhoDrawsWhat) {
  const std::string folder = temporaryFolder();
  const std::vector<SharedBlock> blocks(5);
  writeBytes(folder + "/map", "0 2\n1\t0\n2\n");
  EXPECT_EQ(dealBlocks(blocks, partition("file:" + folder + "/map"), 3), (std::vector<int>{0, 2, 1, 0, 2}));
  const auto expectError = [&](const std::string& text, const std::string& expected) {
    writeBytes(folder + "/map", text);
    try {
      dealBlocks(blocks, partition("file:" + folder + "/map"), 3);
      ADD_FAILURE() << "expected an error: " << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  };
  expectError("0 2 1 0", "expected 5 ranks, one per block, found 4");
  expectError("", "expected 5 ranks, one per block, found 0");
  expectError("0 2 1 0 2 0", "found more");
  expectError("0 2 3 0 2", "number 3: expected a rank from 0 to 2, found '3'");
  expectError("0 -1 0 0 2", "number 2: expected a rank from 0 to 2, found '-1'");
  expectError("0 1x 0 0 2", "found '1x'");
  expectError("0 99999999999 0 0 2", "found '99999999999'");
  EXPECT_THROW(dealBlocks(blocks, partition("file:" + folder + "/none"), 3), InputError);
  EXPECT_THROW(dealBlocks(blocks, partition("file:" + folder), 3), InputError);
}

TEST(Partition, OtherNamesAreRefused) {
  Partition result;
  for (const std::string text : {"", "roundrobin", "random", "random:", "random:x", "random:-1", "random:1.5",
                                 "random:18446744073709551616", "file:", "slab "}) {
    EXPECT_FALSE(parsePartition(text, result)) << text;
  }
}

TEST(Balance, IsMeanOverLargest) {
  const std::vector<uint64_t> uneven = {1, 2, 3, 6}, even = {7, 7}, idle = {0, 0};
  EXPECT_DOUBLE_EQ(balance(uneven), 0.5);
  EXPECT_DOUBLE_EQ(balance(even), 1.0);
  EXPECT_DOUBLE_EQ(balance(idle), 1.0);
  EXPECT_DOUBLE_EQ(balance({}), 1.0);
}

}  // namespace
}  // namespace freevoxel::test
