// The additive composite. mpirun starts this with several numbers of ranks; every rank runs all of it.
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>
#include <stdexcept>

#include "parallel/composite.h"

namespace freevoxel {
namespace {

constexpr int kChannels = 6;
constexpr float kQuantum = 0x1p-20f;
const std::array<float, kChannels> kLimits = {16.0f, 16.0f, 16.0f, 16.0f, 0x1p18f, 0x1p8f};

const Ranks& ranks() {
  static int argc = 0;
  static char** argv = nullptr;
  static const Ranks all(argc, argv);
  return all;
}

enum class Cover { everywhere, patches, nowhere, oneRankOnly };

/// What a rank has drawn; any rank can make any other's. Whole quanta, small enough that the sum of all is exact.
Image drawnBy(int rank, glm::ivec2 size, Cover cover) {
  Image image(size, kChannels);
  std::mt19937 random(unsigned(rank) * 7919u + unsigned(size.x));
  const int64_t pixels = int64_t(size.x) * size.y;
  for (int64_t i = 0; i < pixels; ++i) {
    const bool here = cover == Cover::everywhere || (cover == Cover::patches && (i / 97 + rank) % 5 == 0) ||
                      (cover == Cover::oneRankOnly && rank == ranks().rankCount() - 1);
    for (int c = 0; c < kChannels && here; ++c)
      image.pixels[size_t(i * kChannels + c)] = float(random() % 1000003) * kQuantum;
  }
  return image;
}

Image expectedSum(glm::ivec2 size, Cover cover) {
  Image sum(size, kChannels);
  for (int rank = 0; rank < ranks().rankCount(); ++rank) {
    const Image image = drawnBy(rank, size, cover);
    for (size_t i = 0; i < sum.pixels.size(); ++i)
      sum.pixels[i] += image.pixels[i];
  }
  return sum;
}

bool sameBits(const Image& a, const Image& b) {
  return std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)) == 0;
}

// From one pixel, with which most ranks have no band at all.
const std::vector<glm::ivec2> kSizes = {{1, 1}, {1, 7}, {63, 1}, {64, 1}, {65, 3}, {301, 197}};

TEST(Composite, IsTheSumWhateverIsCovered) {
  for (const glm::ivec2 size : kSizes) {
    for (const Cover cover : {Cover::everywhere, Cover::patches, Cover::nowhere, Cover::oneRankOnly}) {
      Image tiles = drawnBy(ranks().rank(), size, cover), reduced = tiles;
      Compositor compositor(ranks(), size, kChannels);
      EXPECT_TRUE(compositor.add(tiles, kLimits));
      EXPECT_TRUE(addByReduce(ranks(), reduced, kLimits));
      if (!ranks().isRoot()) continue;
      const Image expected = expectedSum(size, cover);
      EXPECT_TRUE(sameBits(tiles, expected)) << size.x << 'x' << size.y << ", cover " << int(cover);
      EXPECT_TRUE(sameBits(reduced, expected)) << size.x << 'x' << size.y << ", cover " << int(cover);
    }
  }
}

TEST(Composite, ImagesLargerThanASlice) {
  for (const size_t slicePixels : {size_t(64), size_t(640), size_t(301 * 197 - 1), size_t(301 * 197)}) {
    Image image = drawnBy(ranks().rank(), {301, 197}, Cover::patches);
    Compositor compositor(ranks(), image.size, kChannels, slicePixels);
    EXPECT_TRUE(compositor.add(image, kLimits));
    if (ranks().isRoot()) {
      EXPECT_TRUE(sameBits(image, expectedSum(image.size, Cover::patches))) << slicePixels;
    }
  }
}

// A frame after the other through one compositor.
TEST(Composite, AgainAndAgain) {
  const glm::ivec2 size(123, 45);
  Compositor compositor(ranks(), size, kChannels);
  for (int frame = 0; frame < 5; ++frame) {
    const Cover cover = frame % 2 == 0 ? Cover::everywhere : Cover::patches;
    Image image = drawnBy(ranks().rank(), size, cover);
    EXPECT_TRUE(compositor.add(image, kLimits));
    if (ranks().isRoot()) {
      EXPECT_TRUE(sameBits(image, expectedSum(size, cover)));
    }
  }
}

// One sum too large, in any band, of any channel: every rank is told.
TEST(Composite, TellsEveryRankWhatIsNotExact) {
  const glm::ivec2 size(301, 7);
  for (const size_t pixel : {size_t(0), size_t(300), size_t(1044), size_t(2106)}) {
    for (int channel = 0; channel < kChannels; ++channel) {
      for (const float share : {1.0f, 0.999f}) {
        Image image(size, kChannels);
        // Every rank adds its part of the limit.
        float& value = image.pixels[pixel * kChannels + size_t(channel)];
        value = std::floor(kLimits[size_t(channel)] * share * 16.0f / float(ranks().rankCount())) / 16.0f;
        if (share == 1.0f && ranks().isRoot()) {
          value = kLimits[size_t(channel)] - value * float(ranks().rankCount() - 1);
        }
        Image reduced = image;
        Compositor compositor(ranks(), size, kChannels);
        EXPECT_EQ(compositor.add(image, kLimits), share < 1.0f);
        EXPECT_EQ(addByReduce(ranks(), reduced, kLimits), share < 1.0f);
      }
    }
  }
}

// At most its image once, its band, and a bit per tile: whatever the number of ranks.
TEST(Composite, BytesDoNotGrowWithRanks) {
  const glm::ivec2 size(640, 480);
  const double imageBytes = 640.0 * 480.0 * kChannels * sizeof(float);
  const int rankCount = ranks().rankCount();
  const auto sent = [&](Cover cover) {
    Image image = drawnBy(ranks().rank(), size, cover);
    Compositor compositor(ranks(), size, kChannels);
    compositor.add(image, kLimits);
    return double(compositor.traffic().sentBytes);
  };
  EXPECT_LE(sent(Cover::everywhere), 1.02 * imageBytes);
  if (rankCount == 1) {
    EXPECT_EQ(sent(Cover::everywhere), 0.0);
    return;
  }
  const double band = ranks().isRoot() ? 0.0 : 1.0 / rankCount;
  EXPECT_NEAR(sent(Cover::everywhere) / imageBytes, 1.0 - 1.0 / rankCount + band, 0.02);
  EXPECT_LE(sent(Cover::nowhere), 0.002 * imageBytes);
}

TEST(Rounds, MultiplyToTheNumberOfRanks) {
  EXPECT_TRUE(compositeRounds(1).empty());
  EXPECT_EQ(compositeRounds(8), (std::vector<int>{8}));
  EXPECT_EQ(compositeRounds(128), (std::vector<int>{8, 8, 2}));
  EXPECT_EQ(compositeRounds(11), (std::vector<int>{11}));
  EXPECT_EQ(compositeRounds(2 * 3 * 17), (std::vector<int>{6, 17}));
  for (int count = 1; count <= 5000; ++count) {
    int product = 1;
    for (const int radix : compositeRounds(count))
      product *= radix;
    ASSERT_EQ(product, count);
  }
}

TEST(Ranks, TellEachOtherOfTheLowestThatFailed) {
  EXPECT_FALSE(ranks().agree(std::nullopt));
  EXPECT_NO_THROW(ranks().agree());
  const int rank = ranks().rank(), rankCount = ranks().rankCount();
  for (int first = 0; first < rankCount; ++first) {
    std::optional<Failure> mine;
    if (rank >= first && (rank - first) % 2 == 0)
      mine = Failure{rank, 1 + rank, "rank's own reason " + std::to_string(rank)};
    const std::optional<Failure> told = ranks().agree(mine);
    ASSERT_TRUE(told);
    EXPECT_EQ(told->rank, first);
    EXPECT_EQ(told->status, 1 + first);
    EXPECT_EQ(told->text, "rank's own reason " + std::to_string(first));
  }
}

TEST(Ranks, OneThatFailsMeetsTheOthersAtTheirNextAgreement) {
  const int rank = ranks().rank(), last = ranks().rankCount() - 1;
  if (last == 0) GTEST_SKIP() << "there are no others";
  std::optional<Failure> failure;
  try {
    if (rank == last) throw std::runtime_error("out of luck");
    ranks().agree();
    ADD_FAILURE() << "the others must hear of it";
  } catch (const RankFailed& other) {
    failure = other.failure;
  } catch (const std::exception& error) {
    failure = ranks().agree(Failure{rank, 1, error.what()});
  }
  ASSERT_TRUE(failure);
  EXPECT_EQ(failure->rank, last);
  EXPECT_EQ(failure->text, "out of luck");
}

TEST(Ranks, GatherTextsOfAnyLength) {
  const std::string mine(size_t(ranks().rank() * 1000 % 3001), char('a' + ranks().rank()));
  const std::vector<std::string> all = ranks().gatherEverywhere(mine);
  ASSERT_EQ(all.size(), size_t(ranks().rankCount()));
  for (size_t rank = 0; rank < all.size(); ++rank)
    EXPECT_EQ(all[rank], std::string(rank * 1000 % 3001, char('a' + rank)));
}

TEST(Ranks, KnowWhenTheyAreOutOfStep) {
  int argc = 0;
  char** argv = nullptr;
  if (startedByLauncher()) {
    { const Ranks::Exchange exchange(ranks()); }
    EXPECT_FALSE(ranks().outOfStep());
    return;
  }
  const Ranks alone(argc, argv);
  EXPECT_EQ(alone.rankCount(), 1);
  EXPECT_TRUE(alone.isRoot());
  try {
    const Ranks::Exchange exchange(alone);
    throw std::runtime_error("alone nobody waits");
  } catch (const std::runtime_error&) {
  }
  EXPECT_FALSE(alone.outOfStep());
}

}  // namespace
}  // namespace freevoxel
