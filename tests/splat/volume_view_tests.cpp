#include "splat/volume_view.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>

#include "hierarchy/direction_lookup.h"
#include "shaders/shared/directions.h"

namespace freevoxel {
namespace {

TEST(Directions, IndexAndComponentsAreInverse) {
  for (int k = 0; k < shared::kDirectionCount; ++k) {
    const int x = shared::directionX(k), y = shared::directionY(k), z = shared::directionZ(k);
    EXPECT_EQ(shared::directionIndex(x, y, z), k);
    EXPECT_EQ(shared::directionIndex(-x, -y, -z), shared::oppositeDirection(k));
    EXPECT_NE(x * x + y * y + z * z, 0);
  }
}

TEST(DirectionLookup, AlongAnAxisIsOneDirection) {
  const DirectionTriangle triangle = directionTriangle({0.0, -1.0, 0.0});
  EXPECT_EQ(triangle.index[0], shared::directionIndex(0, -1, 0));
  const std::array<float, 3> weights = directionWeights(triangle, {0.0, -1.0, 0.0});
  EXPECT_EQ(weights[0], 1.0f);
  EXPECT_EQ(weights[1], 0.0f);
  EXPECT_EQ(weights[2], 0.0f);
}

TEST(DirectionLookup, WeightsRebuildTheDirection) {
  // sum of weight * direction is u / a: where the ray crosses the next plane of voxels.
  for (const glm::dvec3 u : {glm::dvec3(1, 2, 3), glm::dvec3(-3, 1, 2), glm::dvec3(0.1, -5, 4.9)}) {
    const DirectionTriangle triangle = directionTriangle(u);
    const std::array<float, 3> weights = directionWeights(triangle, u);
    glm::dvec3 sum(0.0);
    double total = 0.0;
    for (size_t k = 0; k < 3; ++k) {
      const int index = triangle.index[k];
      sum += double(weights[k]) *
             glm::dvec3(shared::directionX(index), shared::directionY(index), shared::directionZ(index));
      total += double(weights[k]);
    }
    EXPECT_NEAR(total, 1.0, 1e-6);
    EXPECT_LT(glm::length(sum - u / std::abs(u[triangle.axis[0]])), 1e-6);
  }
}

TEST(NearestDirection, IsNearestByAngleInSpaceNotInIndices) {
  const glm::dmat3 stretched(glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 4));
  // (1,0,1) in indices points along (1,0,4): 14 degrees off z. A ray 20 degrees off z is nearest to it.
  const double angle = 20.0 * 3.14159265358979 / 180.0;
  EXPECT_EQ(nearestDirection(stretched, {std::sin(angle), 0, std::cos(angle)}), shared::directionIndex(1, 0, 1));
  EXPECT_EQ(nearestDirection(glm::dmat3(1.0), {std::sin(angle), 0, std::cos(angle)}), shared::directionIndex(0, 0, 1));
}

TEST(VolumeView, LengthsAreInShortestEdges) {
  Placement placement;
  placement.spacing = {0.5, 1.5, 1.0};
  placement.origin = {10.0, 20.0, 30.0};
  Camera camera;
  camera.eye = {10.0, 20.0, 40.0};
  camera.target = placement.origin;
  camera.imageSize = {64, 48};
  const VolumeView view = volumeView(placement, camera);
  EXPECT_NEAR(view.voxelVolume, 1.0 * 3.0 * 2.0, 1e-12);
  EXPECT_NEAR(view.viewPosition({0, 0, 0}).z, -20.0, 1e-12);
  EXPECT_NEAR(view.viewPosition({2, 0, 0}).x, 2.0, 1e-12);
  EXPECT_NEAR(view.viewPosition({0, 2, 0}).y, 6.0, 1e-12);
}

}  // namespace
}  // namespace freevoxel
