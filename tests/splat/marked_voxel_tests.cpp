// A marked voxel lands on the pixel computed by hand, for every orientation of the index axes.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>

#include "tests/splat/scene.h"

namespace freevoxel {
namespace {

using namespace test;

/// Centre of mass of S_o, in pixels.
glm::dvec2 centreOfLight(const Image& sums) {
  glm::dvec2 centre(0.0);
  double total = 0.0;
  for (int y = 0; y < sums.size.y; ++y) {
    for (int x = 0; x < sums.size.x; ++x) {
      const double light = double(sums.at(x, y)[3]);
      centre += light * (glm::dvec2(x, y) + 0.5);
      total += light;
    }
  }
  return centre / total;
}

const glm::ivec3 kDims(5, 7, 11);
const glm::ivec3 kMarked(4, 1, 8);

Volume markedVolume(const Placement& placement) {
  Volume volume = makeVolume(kDims, placement.spacing,
                             [](int x, int y, int z) { return glm::ivec3(x, y, z) == kMarked ? 255 : 0; });
  volume.header.placement = placement;
  return volume;
}

// Unit spacing, looking along -z, one pixel per tenth of a length: by hand, no matrix of ours involved.
TEST(MarkedVoxel, LookingAlongMinusZ) {
  const Scene scene = makeScene(markedVolume({}), uniformOpacity(0.9), 8);
  Camera camera;
  camera.eye = {2.0, 3.0, 50.0};
  camera.target = {2.0, 3.0, 0.0};
  camera.orthographicHeight = 10.0;
  camera.imageSize = {120, 100};
  // 10 pixels per length; image centre (60, 50) shows (2, 3); x right, y up.
  const glm::dvec2 expected(60.0 + (4.0 - 2.0) * 10.0, 50.0 - (1.0 - 3.0) * 10.0);
  const glm::dvec2 found = centreOfLight(splatScene(scene, camera, kKernel).sums.image);
  EXPECT_NEAR(found.x, expected.x, 0.02);
  EXPECT_NEAR(found.y, expected.y, 0.02);
}

// From the right (+x): z runs to the left.
TEST(MarkedVoxel, LookingAlongMinusX) {
  const Scene scene = makeScene(markedVolume({}), uniformOpacity(0.9), 8);
  Camera camera;
  camera.eye = {50.0, 3.0, 5.0};
  camera.target = {0.0, 3.0, 5.0};
  camera.orthographicHeight = 10.0;
  camera.imageSize = {120, 100};
  const glm::dvec2 expected(60.0 - (8.0 - 5.0) * 10.0, 50.0 - (1.0 - 3.0) * 10.0);
  const glm::dvec2 found = centreOfLight(splatScene(scene, camera, kKernel).sums.image);
  EXPECT_NEAR(found.x, expected.x, 0.02);
  EXPECT_NEAR(found.y, expected.y, 0.02);
}

TEST(MarkedVoxel, EveryPermutationAndMirroringOfTheAxes) {
  const glm::dvec3 spacing(0.3, 1.1, 2.7);
  const glm::dvec3 origin(-3.0, 12.0, 0.5);
  const int permutations[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const auto& permutation : permutations) {
    for (int mirror = 0; mirror < 8; ++mirror) {
      Placement placement;
      placement.spacing = spacing;
      placement.origin = origin;
      glm::dvec3 world = origin;
      placement.direction = glm::dmat3(0.0);
      for (int axis = 0; axis < 3; ++axis) {
        const double sign = (mirror >> axis) & 1 ? -1.0 : 1.0;
        placement.direction[axis][permutation[axis]] = sign;
        world[permutation[axis]] += sign * spacing[axis] * kMarked[axis];
      }
      const Scene scene = makeScene(markedVolume(placement), uniformOpacity(0.9), 8);
      // A perspective camera whose view axes are world axes: (x - ex) f / z to the right of the centre.
      Camera camera;
      camera.eye = scene.bounds().centre() + glm::dvec3(1.0, -2.0, 150.0);
      camera.target = camera.eye - glm::dvec3(0.0, 0.0, 1.0);
      camera.imageSize = {640, 480};
      camera.verticalFov = 2.0 * std::atan(0.25);
      const double f = 240.0 / 0.25;
      const double z = camera.eye.z - world.z;
      const glm::dvec2 expected(320.0 + (world.x - camera.eye.x) * f / z, 240.0 - (world.y - camera.eye.y) * f / z);
      const SplatResult result = splatScene(scene, camera, kKernel);
      const glm::dvec2 found = centreOfLight(result.sums.image);
      EXPECT_NEAR(found.x, expected.x, 0.05) << permutation[0] << permutation[1] << permutation[2] << " " << mirror;
      EXPECT_NEAR(found.y, expected.y, 0.05) << permutation[0] << permutation[1] << permutation[2] << " " << mirror;
      // The reference must agree on where things are, independently of the splatter.
      const Image cast = raycastScene(scene, camera, {RaycastClassification::nearest, 0.25});
      double light = 0.0;
      glm::dvec2 centre(0.0);
      for (int y = 0; y < cast.size.y; ++y) {
        for (int x = 0; x < cast.size.x; ++x) {
          light += double(cast.at(x, y)[3]);
          centre += double(cast.at(x, y)[3]) * (glm::dvec2(x, y) + 0.5);
        }
      }
      // A pixel: the box of one voxel is cut into whole pixels, and nearer parts of it look larger.
      EXPECT_LT(glm::length(centre / light - expected), 1.0) << permutation[0] << permutation[1] << permutation[2];
    }
  }
}

}  // namespace
}  // namespace freevoxel
