// The Hilbert curve: everything that the file's order promises, for every voxel of every small cube.
#include "precompute/hilbert.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>
#include <vector>

#include "base/grid.h"

namespace freevoxel {
namespace {

int manhattan(glm::ivec3 a, glm::ivec3 b) {
  return std::abs(a.x - b.x) + std::abs(a.y - b.y) + std::abs(a.z - b.z);
}

class HilbertOrder : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Orders, HilbertOrder, testing::Range(0, 7));

TEST_P(HilbertOrder, visitsEveryVoxelOnceAndStepsToANeighbour) {
  const int order = GetParam();
  const glm::ivec3 dims(1 << order);
  std::vector<bool> seen(voxelCount(dims));
  glm::ivec3 previous(0);
  for (uint64_t index = 0; index < seen.size(); ++index) {
    const glm::ivec3 p = hilbertPosition(index, order);
    ASSERT_TRUE(p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < dims.x && p.y < dims.y && p.z < dims.z);
    ASSERT_FALSE(seen[linearIndex(p, dims)]);
    seen[linearIndex(p, dims)] = true;
    ASSERT_EQ(hilbertIndex(p, order), index);
    if (index > 0) {
      ASSERT_EQ(manhattan(p, previous), 1) << index;
    }
    previous = p;
  }
}

TEST(Hilbert, parentsIndexIsTheChildsShifted) {
  for (int order = 1; order <= 6; ++order) {
    for (uint64_t index = 0; index < uint64_t(1) << (3 * order); ++index) {
      const glm::ivec3 p = hilbertPosition(index, order);
      ASSERT_EQ(hilbertIndex({p.x >> 1, p.y >> 1, p.z >> 1}, order - 1), index >> 3);
    }
  }
}

TEST_P(HilbertOrder, localCurvesAreTheGlobalCurve) {
  const int order = GetParam();
  for (int brickOrder = 0; brickOrder <= std::min(order, 5); ++brickOrder) {
    const int bricksOrder = order - brickOrder;
    const uint64_t inBrick = uint64_t(1) << (3 * brickOrder);
    for (uint64_t brick = 0; brick < uint64_t(1) << (3 * bricksOrder); ++brick) {
      const glm::ivec3 position = hilbertPosition(brick, bricksOrder);
      const auto curve = hilbertCurve(hilbertState(position, bricksOrder), brickOrder);
      ASSERT_EQ(curve.size(), inBrick);
      for (uint64_t step = 0; step < inBrick; ++step) {
        const glm::ivec3 local(curve[step].x, curve[step].y, curve[step].z);
        ASSERT_EQ(hilbertIndex(position * (1 << brickOrder) + local, order), brick * inBrick + step);
      }
    }
  }
}

TEST(Hilbert, stepsInvertCurves) {
  for (int state = 0; state < kHilbertStateCount; ++state) {
    for (int brickOrder = 0; brickOrder <= 5; ++brickOrder) {
      const auto curve = hilbertCurve(state, brickOrder);
      const auto steps = hilbertSteps(state, brickOrder);
      ASSERT_EQ(steps.size(), curve.size());
      for (size_t step = 0; step < curve.size(); ++step) {
        const glm::ivec3 local(curve[step].x, curve[step].y, curve[step].z);
        ASSERT_EQ(steps[linearIndex(local, glm::ivec3(1 << brickOrder))], step);
      }
    }
  }
}

TEST(Hilbert, everyStateIsReachedAndRunsDifferently) {
  std::set<int> states;
  for (uint64_t brick = 0; brick < 4096; ++brick)
    states.insert(hilbertState(hilbertPosition(brick, 4), 4));
  EXPECT_EQ(states.size(), size_t(kHilbertStateCount));
  std::set<std::vector<uint16_t>> runs;
  for (int state = 0; state < kHilbertStateCount; ++state) {
    const auto steps = hilbertSteps(state, 1);
    runs.emplace(steps.begin(), steps.end());
  }
  EXPECT_EQ(runs.size(), size_t(kHilbertStateCount));
}

TEST(Hilbert, largestOrderRoundTrips) {
  const int order = 21;
  const int last = (1 << order) - 1;
  for (const glm::ivec3 p :
       {glm::ivec3(0), glm::ivec3(last), glm::ivec3(last, 0, 1), glm::ivec3(123456, 2000001, 77)}) {
    const uint64_t index = hilbertIndex(p, order);
    EXPECT_LT(index, uint64_t(1) << 63);
    EXPECT_EQ(hilbertPosition(index, order), p);
  }
}

TEST(Hilbert, orderIsThatOfTheSmallestCube) {
  EXPECT_EQ(hilbertOrder({1, 1, 1}), 0);
  EXPECT_EQ(hilbertOrder({1, 2, 1}), 1);
  EXPECT_EQ(hilbertOrder({5, 7, 11}), 4);
  EXPECT_EQ(hilbertOrder({16, 16, 16}), 4);
  EXPECT_EQ(hilbertOrder({16, 16, 17}), 5);
  EXPECT_EQ(hilbertOrder({1, kMaxDim, 3}), 21);
}

}  // namespace
}  // namespace freevoxel
