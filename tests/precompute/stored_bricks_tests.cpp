// Which bricks are stored, against the rule in plain loops.
#include "precompute/stored_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "base/grid.h"
#include "precompute/hilbert.h"
#include "tests/precompute/test_volumes.h"

namespace freevoxel {
namespace {

/// The rule, cell by cell, through largestOpacity itself. Hilbert index -> visible voxels.
std::map<uint64_t, uint32_t> expectedBricks(std::span<const uint16_t> codes, glm::ivec3 dims, int edge,
                                            const TransferFunction& transfer, const ValueCoding& coding) {
  const int order = brickCurveOrder(dims, edge);
  const auto clamped = [&](glm::ivec3 p) {
    return glm::ivec3(std::clamp(p.x, 0, dims.x - 1), std::clamp(p.y, 0, dims.y - 1), std::clamp(p.z, 0, dims.z - 1));
  };
  std::map<uint64_t, uint32_t> bricks;
  for (int z = -1; z < dims.z; ++z) {
    for (int y = -1; y < dims.y; ++y) {
      for (int x = -1; x < dims.x; ++x) {
        double low = INFINITY, high = -INFINITY;
        glm::ivec3 corners[8];
        for (int i = 0; i < 8; ++i) {
          corners[i] = clamped(glm::ivec3(x, y, z) + glm::ivec3(i & 1, i >> 1 & 1, i >> 2));
          const double value = coding.decode(codes[linearIndex(corners[i], dims)]);
          low = std::min(low, value);
          high = std::max(high, value);
        }
        if (!(transfer.largestOpacity(low, high) > 0.0)) continue;
        for (const glm::ivec3 corner : corners)
          bricks.try_emplace(hilbertIndex(corner / edge, order), 0);
      }
    }
  }
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x) {
        const double value = coding.decode(codes[linearIndex({x, y, z}, dims)]);
        if (transfer.opacityAt(value) > 0.0) ++bricks.at(hilbertIndex(glm::ivec3(x, y, z) / edge, order));
      }
    }
  }
  return bricks;
}

void expectRule(const Volume& volume, int edge, const TransferFunction& transfer) {
  const glm::ivec3 dims = volume.header.dims;
  const ValueCoding coding = valueCoding(volume.header.type, transfer.low, transfer.high);
  const auto codes = encodeValues(volume, coding);
  std::map<uint64_t, uint32_t> found;
  uint64_t previous = 0;
  for (const StoredBrick& brick : findStoredBricks(codes, dims, edge, transfer, coding)) {
    if (!found.empty()) {
      EXPECT_GT(brick.hilbertIndex, previous);
    }
    previous = brick.hilbertIndex;
    EXPECT_EQ(hilbertIndex(brick.position, brickCurveOrder(dims, edge)), brick.hilbertIndex);
    found[brick.hilbertIndex] = brick.visibleVoxels;
  }
  EXPECT_EQ(found, expectedBricks(codes, dims, edge, transfer, coding));
}

/// Few voxels above 0, none at the ramp itself unless `density` is large.
Volume sparse(glm::ivec3 dims, uint32_t seed, double density) {
  std::mt19937 random(seed);
  return test::makeVolume<uint8_t>(ValueType::u8, dims, [&](int, int, int) {
    return uint8_t(double(random()) / 4294967296.0 < density ? random() % 256 : 0);
  });
}

class StoredBricks : public testing::TestWithParam<glm::ivec3> {};
INSTANTIATE_TEST_SUITE_P(Dims, StoredBricks,
                         testing::Values(glm::ivec3(1, 1, 1), glm::ivec3(5, 7, 11), glm::ivec3(17, 3, 33),
                                         glm::ivec3(9, 17, 8), glm::ivec3(1, 40, 2), glm::ivec3(33, 24, 41)));

TEST_P(StoredBricks, followTheRuleCellByCell) {
  for (const double density : {0.0, 0.0005, 0.01, 0.5}) {
    for (const int edge : {8, 16}) {
      for (uint32_t seed = 1; seed <= 3; ++seed)
        expectRule(sparse(GetParam(), seed, density), edge, test::veilAndRamp());
    }
  }
}

TEST_P(StoredBricks, seeOpacityBetweenCodes) {
  // Opaque only between codes 10 and 11, where no voxel is: visible cells without a visible voxel.
  TransferFunction transfer;
  transfer.points = {{10.2, {}, 0.0}, {10.5, {}, 0.5}, {10.8, {}, 0.0}};
  expectRule(sparse(GetParam(), 9, 0.01), 8, transfer);
}

TEST_P(StoredBricks, seeStepsAtACode) {
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}, {40.0, {}, 0.0}, {40.0, {}, 0.5}, {60.0, {}, 0.5}, {60.0, {}, 0.0}};
  for (uint32_t seed = 1; seed <= 3; ++seed)
    expectRule(sparse(GetParam(), seed, 0.02), 8, transfer);
}

TEST(StoredBrick, allAreStoredWhereZeroIsVisibleAndNoneWhereNothingIs) {
  const glm::ivec3 dims(17, 3, 33);
  const Volume volume = sparse(dims, 1, 0.0);
  const ValueCoding coding = valueCoding(ValueType::u8, 0.0, 255.0);
  const auto codes = encodeValues(volume, coding);
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.25}};
  const auto all = findStoredBricks(codes, dims, 8, transfer, coding);
  EXPECT_EQ(all.size(), 3u * 1u * 5u);
  uint64_t visible = 0;
  for (const StoredBrick& brick : all)
    visible += brick.visibleVoxels;
  EXPECT_EQ(visible, voxelCount(dims));
  transfer.points = {{0.0, {}, 0.0}};
  EXPECT_TRUE(findStoredBricks(codes, dims, 8, transfer, coding).empty());
}

TEST(StoredBrick, visibleVoxelAtABorderStoresTheNeighbourItsCellsTouch) {
  // Voxel 7 is the last of the first brick; its cell with voxel 8 is visible, so the second brick is stored too.
  const glm::ivec3 dims(24, 1, 1);
  const Volume volume =
      test::makeVolume<uint8_t>(ValueType::u8, dims, [](int x, int, int) { return x == 7 ? 255 : 0; });
  const ValueCoding coding = valueCoding(ValueType::u8, 0.0, 255.0);
  const auto bricks = findStoredBricks(encodeValues(volume, coding), dims, 8, test::veilAndRamp(), coding);
  ASSERT_EQ(bricks.size(), 2u);
  EXPECT_EQ(bricks[0].visibleVoxels + bricks[1].visibleVoxels, 1u);
  EXPECT_EQ(std::max(bricks[0].position.x, bricks[1].position.x), 1);
}

}  // namespace
}  // namespace freevoxel
