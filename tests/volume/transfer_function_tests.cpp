#include "volume/transfer_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace freevoxel {

namespace {

/// Red to blue, with a step of opacity at 20 and constant ends.
TransferFunction exampleTransfer() {
  TransferFunction transfer;
  transfer.low = 0.0;
  transfer.high = 40.0;
  transfer.points = {{10.0, {1.0, 0.0, 0.0}, 0.2},
                     {20.0, {0.5, 0.0, 0.5}, 0.6},
                     {20.0, {0.5, 0.0, 0.5}, 0.1},
                     {30.0, {0.0, 0.0, 1.0}, 0.3}};
  return transfer;
}

TEST(TransferFunction, sameOpacityIsThatOfTheFunctionNotOfItsPoints) {
  TransferFunction one;
  one.points = {{20.0, glm::dvec3(1.0), 0.0}, {100.0, glm::dvec3(1.0), 0.3}, {100.0, {}, 0.5}, {200.0, {}, 0.1}};
  TransferFunction other = one;
  other.points[1].srgb = glm::dvec3(0.2);
  other.points.insert(other.points.begin() + 1, {60.0, {}, 0.15});
  other.points.push_back({230.0, {}, 0.1});
  EXPECT_TRUE(sameOpacity(one, other));
  EXPECT_TRUE(sameOpacity(other, one));
  const auto expectDifferent = [&](auto&& change) {
    TransferFunction changed = one;
    change(changed);
    EXPECT_FALSE(sameOpacity(one, changed));
    EXPECT_FALSE(sameOpacity(changed, one));
  };
  expectDifferent([](TransferFunction& t) { t.points[0].opacity = 0.001; });
  expectDifferent([](TransferFunction& t) { t.points[1].opacity = 0.31; });  // below the step only
  expectDifferent([](TransferFunction& t) { t.points[2].opacity = 0.51; });
  expectDifferent([](TransferFunction& t) { t.points[3].value = 201.0; });
  expectDifferent([](TransferFunction& t) { t.points.insert(t.points.begin() + 1, {60.0, {}, 0.16}); });
  expectDifferent([](TransferFunction& t) { t.high = 254.0; });
  expectDifferent([](TransferFunction& t) { t.low = 1.0; });
  expectDifferent([](TransferFunction& t) { t.referenceLength = 2.0; });
  expectDifferent([](TransferFunction& t) { t.isLabels = true; });
}

}  // namespace

TEST(TransferFunction, isLinearBetweenItsPointsAndConstantBeyond) {
  const TransferFunction t = exampleTransfer();
  EXPECT_DOUBLE_EQ(t.opacityAt(0.0), 0.2);
  EXPECT_DOUBLE_EQ(t.opacityAt(10.0), 0.2);
  EXPECT_DOUBLE_EQ(t.opacityAt(15.0), 0.4);
  EXPECT_DOUBLE_EQ(t.opacityAt(25.0), 0.2);
  EXPECT_DOUBLE_EQ(t.opacityAt(35.0), 0.3);
  EXPECT_DOUBLE_EQ(t.srgbAt(15.0).r, 0.75);
  EXPECT_DOUBLE_EQ(t.srgbAt(15.0).b, 0.25);
  EXPECT_EQ(t.srgbAt(-3.0), glm::dvec3(1.0, 0.0, 0.0));
}

TEST(TransferFunction, atAStepTheLaterPointHolds) {
  const TransferFunction t = exampleTransfer();
  EXPECT_DOUBLE_EQ(t.opacityAt(20.0), 0.1);
  EXPECT_NEAR(t.opacityAt(std::nextafter(20.0, 0.0)), 0.6, 1e-12);
}

TEST(TransferFunction, valuesAreClampedToTheRangeFirst) {
  TransferFunction t = exampleTransfer();
  t.low = 12.0;
  t.high = 25.0;
  EXPECT_DOUBLE_EQ(t.opacityAt(-100.0), t.opacityAt(12.0));
  EXPECT_DOUBLE_EQ(t.opacityAt(30.0), 0.2);
  EXPECT_DOUBLE_EQ(t.opacityAt(NAN), t.opacityAt(12.0));
  EXPECT_DOUBLE_EQ(t.opacityAt(std::numeric_limits<double>::infinity()), 0.2);
}

TEST(TransferFunction, extinctionIsPerVoxelEdge) {
  TransferFunction t;
  t.points = {{0.0, {}, 0.5}};
  EXPECT_DOUBLE_EQ(t.extinctionAt(1.0), std::log(2.0));
  t.referenceLength = 4.0;
  EXPECT_DOUBLE_EQ(t.extinctionAt(1.0), std::log(2.0) / 4.0);
  t.points[0].opacity = 0.0;
  EXPECT_EQ(t.extinctionAt(1.0), 0.0);
  t.points[0].opacity = 1.0;
  EXPECT_EQ(t.extinctionAt(1.0), kLargestExtinction);
  EXPECT_DOUBLE_EQ(kLargestExtinction, 12.0 * std::log(2.0));
}

TEST(TransferFunction, coloursAreMadeLinearAfterInterpolation) {
  TransferFunction t = exampleTransfer();
  const Classified classified = t.at(20.0);
  EXPECT_NEAR(classified.linear.r, 0.21404114, 1e-6);  // sRGB 0.5
  EXPECT_EQ(classified.linear.g, 0.0f);
  EXPECT_FLOAT_EQ(classified.extinction, float(-std::log(0.9)));
}

TEST(TransferFunction, largestOpacityLooksAtTheCornersBetween) {
  const TransferFunction t = exampleTransfer();
  EXPECT_DOUBLE_EQ(t.largestOpacity(0.0, 5.0), 0.2);
  EXPECT_DOUBLE_EQ(t.largestOpacity(10.0, 15.0), 0.4);
  EXPECT_DOUBLE_EQ(t.largestOpacity(15.0, 25.0), 0.6);
  EXPECT_DOUBLE_EQ(t.largestOpacity(12.0, 20.0), 0.6);  // just below the step
  EXPECT_DOUBLE_EQ(t.largestOpacity(20.0, 20.0), 0.1);
  EXPECT_DOUBLE_EQ(t.largestOpacity(20.0, 25.0), 0.2);
  EXPECT_DOUBLE_EQ(t.largestOpacity(28.0, 1e9), 0.3);
}

TEST(TransferFunction, largestOpacityStopsAtTheRange) {
  TransferFunction t = exampleTransfer();
  t.low = 22.0;
  t.high = 28.0;
  EXPECT_DOUBLE_EQ(t.largestOpacity(-1e9, 1e9), t.opacityAt(28.0));
  EXPECT_DOUBLE_EQ(t.largestOpacity(0.0, 10.0), t.opacityAt(22.0));
  EXPECT_DOUBLE_EQ(t.largestOpacity(30.0, 40.0), t.opacityAt(28.0));
}

TEST(TransferFunction, nothingExceedsLargestOpacity) {
  TransferFunction t;
  t.low = 0.0;
  t.high = 1.0;
  t.points = {{0.1, {}, 0.1}, {0.37, {}, 0.73}, {0.7, {}, 0.3}, {0.9, {}, 0.7}};
  for (double a = -0.05; a < 1.0; a += 0.0317) {
    for (double b = a; b < 1.05; b += 0.0411) {
      const double bound = t.largestOpacity(a, b);
      double largest = 0.0;
      for (int i = 0; i <= 200; ++i)
        largest = std::max(largest, t.opacityAt(std::lerp(a, b, i / 200.0)));
      EXPECT_LE(largest, bound);
      EXPECT_NEAR(largest, bound, 0.03);
    }
  }
}

TEST(TransferFunction, tablesReachBothEnds) {
  const TransferFunction t = exampleTransfer();
  const std::vector<Classified> table = transferTable(t, 5);
  ASSERT_EQ(table.size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(table[i].extinction, t.at(10.0 * double(i)).extinction);
    EXPECT_EQ(table[i].linear, t.at(10.0 * double(i)).linear);
  }
}

TEST(TransferFunction, hashSeesOpacityAndNotColour) {
  const TransferFunction t = exampleTransfer();
  TransferFunction other = t;
  other.points[1].srgb = {0.9, 0.9, 0.9};
  EXPECT_EQ(opacityHash(other), opacityHash(t));
  for (double* figure :
       {&other.low, &other.high, &other.referenceLength, &other.points[2].opacity, &other.points[0].value}) {
    other = t;
    *figure += 0.01;
    EXPECT_NE(opacityHash(other), opacityHash(t));
  }
  other = t;
  other.low = -0.0;
  EXPECT_EQ(opacityHash(other), opacityHash(t));
}

TEST(TransferFunction, hashIsTheSameInEveryRelease) {
  // Files record it: a change here orphans them.
  EXPECT_EQ(opacityHash(exampleTransfer()), 13321800018349333619u);
}

}  // namespace freevoxel
