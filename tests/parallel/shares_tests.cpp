// Whoever draws which block, the sums are the same.
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <random>
#include <set>

#include "parallel/composite_cost.h"
#include "parallel/partition.h"
#include "precompute/checksums.h"
#include "tests/splat/scene.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

/// 32 x 32 x 32 voxels of waves, seen through and into.
Scene waves() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                     {110.0, glm::dvec3(0.2, 0.9, 0.3), 0.0},
                     {140.0, glm::dvec3(0.2, 0.9, 0.3), 0.05},
                     {255.0, glm::dvec3(1.0, 0.4, 0.1), 0.6}};
  return makeScene(makeVolume({32, 32, 32}, {1.0, 0.7, 1.9},
                              [](int x, int y, int z) {
                                return int(127.5 + 60.0 * std::sin(0.3 * x) + 40.0 * std::cos(0.4 * y + 0.2 * z) +
                                           27.0 * std::sin(0.5 * z - 0.1 * x));
                              }),
                   transfer, 8, Classification::preintegrated);
}

uint64_t hashOf(const Image& image) {
  return contentHash(std::as_bytes(std::span(image.pixels)));
}

class Shares : public ::testing::TestWithParam<Footprint> {};
INSTANTIATE_TEST_SUITE_P(Footprints, Shares, ::testing::Values(Footprint::cell, Footprint::kernel));

// A thousand random partitions over seven virtual ranks, each drawn anew: one hash, which is that of the whole.
TEST_P(Shares, AThousandPartitionsGiveOneHash) {
  omp_set_num_threads(1);  // pictures this small gain nothing from more
  const Scene scene = waves();
  const ValueGrid grid = valueGrid(*scene.file);
  Splatter splatter(grid, scene.file.get(), scene.transfer, Backend::cpu, 8);
  ASSERT_GT(splatter.blocks().size(), 50u);
  SplatOptions options;
  options.footprint = GetParam();
  splatter.prepare(randomViews(scene.bounds(), 1, {31, 23}).front(), options);
  const Sums whole = splatter.draw(options.firstQuantum, {}, silentProgress());
  ASSERT_TRUE(sumsAreExact(whole));
  std::vector<SharedBlock> blocks;
  for (const VisibleBlock& block : splatter.blocks())
    blocks.push_back({0, block.origin.z, block.visibleCells});
  std::set<uint64_t> hashes = {hashOf(whole.image)};
  std::set<std::vector<int>> partitions;
  std::mt19937 random(71);
  for (uint64_t seed = 0; seed < 1000; ++seed) {
    const std::vector<int> owners = dealBlocks(blocks, {Partition::Kind::random, seed, ""}, 7);
    partitions.insert(owners);
    // Added in an order of its own each time.
    std::vector<int> ranks = {0, 1, 2, 3, 4, 5, 6};
    std::shuffle(ranks.begin(), ranks.end(), random);
    Image sum(whole.image.size, kSumChannels);
    for (const int rank : ranks) {
      const Sums part = splatter.draw(options.firstQuantum, shareOf(owners, rank), silentProgress());
      for (size_t i = 0; i < sum.pixels.size(); ++i)
        sum.pixels[i] += part.image.pixels[i];
    }
    hashes.insert(hashOf(sum));
  }
  EXPECT_EQ(partitions.size(), 1000u);
  EXPECT_EQ(hashes.size(), 1u);
}

TEST(Shares, AreCountedAsTheyAreDrawn) {
  const Scene scene = waves();
  const ValueGrid grid = valueGrid(*scene.file);
  Splatter splatter(grid, scene.file.get(), scene.transfer, Backend::cpu, 8);
  for (const Camera& camera : randomViews(scene.bounds(), 2, {61, 43})) {
    splatter.prepare(camera, {});
    const std::vector<BlockWork> work = splatter.countWork(camera);
    ASSERT_EQ(work.size(), splatter.blocks().size());
    uint64_t pixels = 0, cells = 0;
    for (const BlockWork& block : work) {
      pixels += block.pixels;
      cells += block.cells;
    }
    splatter.draw(0x1p-20f, {}, silentProgress());
    EXPECT_EQ(splatter.statistics().fragments, pixels);
    EXPECT_GT(cells, 1000u);
    EXPECT_LE(cells, 31u * 31u * 31u + 3u * 31u * 31u + 3u * 31u + 1u);
    // One block alone.
    std::vector<uint8_t> share(work.size());
    share[7] = 1;
    splatter.draw(0x1p-20f, share, silentProgress());
    EXPECT_EQ(splatter.statistics().fragments, work[7].pixels);
    EXPECT_EQ(splatter.statistics().blocks + splatter.statistics().culledBlocks, 1u);
  }
}

// Counted by hand: 100 tiles of 64 pixels, one channel.
TEST(CompositeCost, CountsWhatTravels) {
  const CompositeRates rates{1e9, 2e9, 4e9};
  const CompositeCost none = compositeCost(1, 100, 50, 50, 1, rates);
  EXPECT_EQ(none.sentBytes, 0.0);
  EXPECT_EQ(none.seconds, 0.0);
  // Half of 50 tiles and of 100 bits, and then a band, half of 60 tiles and of 100 bits.
  const CompositeCost two = compositeCost(2, 100, 50, 60, 1, rates);
  const double half = 0.5 * (50.0 * 256.0 + 12.5), band = 0.5 * (60.0 * 256.0 + 12.5);
  EXPECT_NEAR(two.sentBytes, half + band, 1e-9);
  EXPECT_NEAR(two.gatheredBytes, band, 1e-9);
  EXPECT_NEAR(two.seconds, half * (1e-9 + 0.25e-9 + 0.5e-9) + band * 1e-9 + band * (0.25e-9 + 0.5e-9), 1e-15);
  // Whatever the number of ranks, no more than the picture twice over.
  for (const int ranks : {8, 128, 4096, 65536})
    EXPECT_LT(compositeCost(ranks, 100, 100, 100, 1, rates).sentBytes, 1.2 * 100.0 * 256.0);
}

}  // namespace
}  // namespace freevoxel::test
