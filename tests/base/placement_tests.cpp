// Index space to world space, by hand.
#include "base/placement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include "base/error.h"

namespace freevoxel {
namespace {

const glm::ivec3 kDims(5, 7, 11);

TEST(Placement, originIsTheCentreOfTheFirstVoxel) {
  const Placement placement{{0.3, 1.1, 2.7}, {100.0, 80.0, 1.0}, glm::dmat3(1.0)};
  EXPECT_NO_THROW(placement.check());
  EXPECT_EQ(placement.unitLength(), 0.3);
  const glm::dmat4 worldFromIndex = placement.worldFromIndex();
  const glm::dvec3 first(worldFromIndex * glm::dvec4(0.0, 0.0, 0.0, 1.0));
  EXPECT_EQ(first, glm::dvec3(100.0, 80.0, 1.0));
  const glm::dvec3 other(worldFromIndex * glm::dvec4(1.0, 2.0, 3.0, 1.0));
  EXPECT_NEAR(glm::distance(other, glm::dvec3(100.3, 82.2, 9.1)), 0.0, 1e-12);
}

TEST(Placement, boundsReachHalfAVoxelFurther) {
  const Placement placement{{0.3, 1.1, 2.7}, {100.0, 80.0, 1.0}, glm::dmat3(1.0)};
  const Box box = worldBounds(placement, kDims);
  EXPECT_NEAR(glm::distance(box.lower, glm::dvec3(99.85, 79.45, -0.35)), 0.0, 1e-12);
  EXPECT_NEAR(glm::distance(box.extent(), glm::dvec3(1.5, 7.7, 29.7)), 0.0, 1e-12);
}

TEST(Placement, directionColumnsAreTheIndexAxes) {
  // Index x runs along world -y, index y along world z, index z along world x.
  Placement placement{{0.3, 1.1, 2.7}, {0.0, 0.0, 0.0}, glm::dmat3(1.0)};
  placement.direction = glm::dmat3(glm::dvec3(0.0, -1.0, 0.0), {0.0, 0.0, 1.0}, {1.0, 0.0, 0.0});
  const glm::dvec3 world(placement.worldFromIndex() * glm::dvec4(1.0, 2.0, 3.0, 1.0));
  EXPECT_NEAR(glm::distance(world, glm::dvec3(8.1, -0.3, 2.2)), 0.0, 1e-12);
  const Box box = worldBounds(placement, kDims);
  EXPECT_NEAR(glm::distance(box.extent(), glm::dvec3(29.7, 1.5, 7.7)), 0.0, 1e-12);
}

TEST(Placement, checkRefusesWhatHasNoInverse) {
  Placement placement;
  placement.spacing.y = 0.0;
  EXPECT_THROW(placement.check(), InternalError);
  placement = Placement{};
  placement.origin.z = NAN;
  EXPECT_THROW(placement.check(), InternalError);
  placement = Placement{};
  placement.direction[2] = placement.direction[0];
  EXPECT_THROW(placement.check(), InternalError);
}

}  // namespace
}  // namespace freevoxel
