// The leaky baseline, against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/splat/scene.h"

namespace freevoxel {
namespace {

using namespace test;

Image blend(const Scene& scene, const Camera& camera, BlendKernel kernel) {
  const ValueGrid grid = scene.grid();
  return Splatter(grid, nullptr, scene.transfer, Backend::cpu)
      .renderBlended(camera, kernel, {}, silentProgress())
      .image;
}

/// A box of equal voxels seen along z, n voxels deep.
Scene box(int depth, double opacity) {
  return makeScene(makeVolume({21, 19, depth}, glm::dvec3(1.0), [](int, int, int) { return 255; }),
                   uniformOpacity(opacity));
}

// Weights over a plane add up to one, but a pixel's opacity in that plane is 1 - prod(1 - w a), not a: the leak.
TEST(Blended, NormalisedKernelsLeakALittle) {
  for (const double opacity : {0.05, 0.5}) {
    const Scene scene = box(1, opacity);
    const Camera camera = axisView(scene.bounds(), {84, 76}, 19.0);
    const float alpha = blend(scene, camera, BlendKernel::normalised).at(42, 38)[3];
    EXPECT_LT(alpha, opacity);
    EXPECT_GT(alpha, 0.6 * opacity);
  }
}

// The Gaussian of peak 1 and deviation 0.5 adds up to pi / 2 over a plane of voxels.
TEST(Blended, GaussiansOfPeakOneAreTooOpaque) {
  const double opacity = 0.01;
  const Scene scene = box(1, opacity);
  const Camera camera = axisView(scene.bounds(), {84, 76}, 19.0);
  EXPECT_NEAR(blend(scene, camera, BlendKernel::gaussian).at(42, 38)[3], 1.5708 * opacity, 0.1 * opacity);
}

TEST(Blended, NearSplatsCoverFarOnes) {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(1.0, 0.0, 0.0), 0.9}, {255.0, glm::dvec3(0.0, 0.0, 1.0), 0.9}};
  const Scene scene =
      makeScene(makeVolume({15, 17, 12}, glm::dvec3(1.0), [](int, int, int z) { return z < 6 ? 0 : 255; }), transfer);
  // From +z the blue half is in front, from -z the red one.
  Camera camera = axisView(scene.bounds(), {60, 68}, 17.0);
  const Image front = blend(scene, camera, BlendKernel::normalised);
  EXPECT_GT(front.at(30, 34)[2], 0.95f);
  EXPECT_LT(front.at(30, 34)[0], 0.01f);
  camera.eye = 2.0 * camera.target - camera.eye;
  const Image back = blend(scene, camera, BlendKernel::normalised);
  EXPECT_GT(back.at(30, 34)[0], 0.95f);
  EXPECT_LT(back.at(30, 34)[2], 0.01f);
}

}  // namespace
}  // namespace freevoxel
