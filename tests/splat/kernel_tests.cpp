#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "shaders/shared/kernel_splat.h"
#include "splat/sums.h"
#include "tests/splat/scene.h"

namespace freevoxel {
namespace {

using namespace test;

double kernelAt(double distance) {
  const double v = distance * distance / (double(shared::kKernelRadius) * double(shared::kKernelRadius));
  return double(shared::kernelProfile(float(v)));
}

TEST(Kernel, AreaIsOne) {
  double area = 0.0;
  const double radius = double(shared::kKernelRadius);
  const int steps = 20000;
  for (int i = 0; i < steps; ++i) {
    const double r = (i + 0.5) / steps * radius;
    area += 2.0 * std::numbers::pi * r * kernelAt(r) * radius / steps;
  }
  EXPECT_NEAR(area, 1.0, 1e-5);
}

TEST(Kernel, IsNeverNegativeAndZeroFromTheRimOn) {
  for (double r = 0.0; r < 3.0; r += 0.001)
    EXPECT_GE(kernelAt(r), 0.0) << r;
  EXPECT_EQ(shared::kernelProfile(1.0f), 0.0f);
  EXPECT_EQ(shared::kernelProfile(100.0f), 0.0f);
}

// The paper's Fig. 4: the weights of neighbouring splats sum to one.
TEST(Kernel, WeightsOfAPlaneOfVoxelsSumToOne) {
  double largest = 0.0;
  for (double y = 0.0; y <= 0.5; y += 0.05) {
    for (double x = 0.0; x <= 0.5; x += 0.05) {
      double sum = 0.0;
      for (int j = -2; j <= 3; ++j) {
        for (int i = -2; i <= 3; ++i)
          sum += kernelAt(std::hypot(x - i, y - j));
      }
      largest = std::max(largest, std::abs(sum - 1.0));
    }
  }
  EXPECT_LT(largest, 1e-3);
}

/// Sum of optical depth over the image of a single voxel, in pixels times lengths.
double totalDepth(const Image& sums) {
  double total = 0.0;
  for (int y = 0; y < sums.size.y; ++y) {
    for (int x = 0; x < sums.size.x; ++x)
      total += double(sums.at(x, y)[4]) + double(sums.at(x, y)[5]);
  }
  return total;
}

Scene oneVoxel(glm::dvec3 spacing) {
  return makeScene(
      makeVolume({5, 4, 3}, spacing, [](int x, int y, int z) { return x == 2 && y == 1 && z == 1 ? 255 : 0; }),
      uniformOpacity(0.5), 8);
}

TEST(KernelFootprint, IntegratesToTheVoxelsVolumeOrthographic) {
  const glm::dvec3 spacing(0.3, 1.1, 0.7);
  const Scene scene = oneVoxel(spacing);
  for (const double azimuth : {0.0, 0.4, 1.3}) {
    const Camera camera = orbitCamera(scene.bounds(), {azimuth, 0.3, std::nullopt}, {200, 150}, 0.5, 4.0);
    const double pixelsPerUnit = 150.0 / 4.0 * 0.3;
    const double volume = (1.1 / 0.3) * (0.7 / 0.3);
    const double expected = std::log(2.0) * volume * pixelsPerUnit * pixelsPerUnit;
    EXPECT_NEAR(totalDepth(splatScene(scene, camera, kKernel).sums.image) / expected, 1.0, 2e-3) << azimuth;
  }
}

TEST(KernelFootprint, IntegratesToTheVoxelsSolidAngleInPerspective) {
  const Scene scene = oneVoxel({0.3, 1.1, 0.7});
  const glm::dvec3 voxel(0.6, 1.1, 0.7);
  // Off the axis by a good angle: the integral is V f^2 / (z^2 cos t), lengths in shortest edges.
  Camera camera;
  camera.eye = {3.0, 2.0, 14.0};
  camera.target = {0.5, 3.0, 0.0};
  camera.imageSize = {420, 310};
  const ViewFrame frame = viewFrame(camera);
  const double z = project(frame, voxel)->depth / 0.3;
  const double distance = glm::length(voxel - camera.eye) / 0.3;
  const double volume = (1.1 / 0.3) * (0.7 / 0.3);
  const double f = frame.pixelsPerUnit;
  const double expected = std::log(2.0) * volume * f * f / (z * z) * (distance / z);
  EXPECT_NEAR(totalDepth(splatScene(scene, camera, kKernel).sums.image) / expected, 1.0, 5e-3);
}

// A voxel far smaller than a pixel still shows its whole depth: the sum over the pixels does not depend on where it
// lies.
TEST(KernelFootprint, SmallerThanAPixelLosesNothing) {
  const Scene scene = makeScene(
      makeVolume({5, 4, 3}, {1.0, 1.0, 1.0}, [](int x, int y, int z) { return x == 2 && y == 1 && z == 1 ? 255 : 0; }),
      uniformOpacity(0.999), 8);
  for (const double shift : {0.0, 0.21, 0.37, 0.5}) {
    Camera camera = axisView(scene.bounds(), {30, 20}, 60.0);  // a third of a pixel per voxel
    camera.eye.x += shift * 3.0;
    camera.target.x += shift * 3.0;
    const double expected = -std::log(0.001) / 9.0;
    EXPECT_NEAR(totalDepth(splatScene(scene, camera, kKernel).sums.image) / expected, 1.0, 2e-3) << shift;
  }
}

// The quantum check and the rounding of DESIGN section 4.
TEST(Quantum, RoundsToNearestTiesToEven) {
  EXPECT_EQ(shared::roundToWhole(0.49f), 0.0f);
  EXPECT_EQ(shared::roundToWhole(0.5f), 0.0f);
  EXPECT_EQ(shared::roundToWhole(1.5f), 2.0f);
  EXPECT_EQ(shared::roundToWhole(2.5f), 2.0f);
  EXPECT_EQ(shared::roundToWhole(8388607.0f), 8388607.0f);
}

TEST(Quantum, DepthSplitsWithoutLoss) {
  for (const float depth : {0.0f, 1e-6f, 0.0156f, 0.015625f, 0.3f, 8.31f, 500.125f}) {
    float high, low;
    shared::splitDepth(64.0f * depth, high, low);
    EXPECT_EQ(high, std::floor(64.0f * depth));
    EXPECT_NEAR(high * shared::kDepthHighUnit + low * shared::kDepthLowUnit, depth, shared::kDepthLowUnit / 2) << depth;
  }
}

TEST(Sums, CheckCatchesASumThatIsTooLarge) {
  Sums sums;
  sums.image = Image({2, 1}, kSumChannels);
  sums.quantum = 0x1p-20f;
  EXPECT_TRUE(sumsAreExact(sums));
  sums.image.at(1, 0)[3] = 16.0f - 0x1p-20f;
  EXPECT_TRUE(sumsAreExact(sums));
  sums.image.at(1, 0)[3] = 16.0f;
  EXPECT_FALSE(sumsAreExact(sums));
  sums.image.at(1, 0)[3] = NAN;
  EXPECT_FALSE(sumsAreExact(sums));
  sums.image.at(1, 0)[3] = 0.0f;
  sums.image.at(0, 0)[4] = 262144.0f;
  EXPECT_FALSE(sumsAreExact(sums));
}

TEST(Resolve, NormalisedHasTheExactOpacity) {
  Sums sums;
  sums.image = Image({3, 1}, kSumChannels);
  sums.lightScale = 2.0f;
  float* pixel = sums.image.at(1, 0);
  pixel[0] = 0.1f;
  pixel[3] = 0.2f;
  pixel[4] = 0.5f;
  pixel[5] = 0.01f;
  const Image picture = resolve(sums, Formula::normalised);
  const float alpha = float(-std::expm1(-0.51));
  EXPECT_FLOAT_EQ(picture.at(1, 0)[3], alpha);
  EXPECT_FLOAT_EQ(picture.at(1, 0)[0], 0.1f * 2.0f * alpha / 0.2f);
  EXPECT_EQ(picture.at(0, 0)[3], 0.0f);
  EXPECT_EQ(picture.at(0, 0)[0], 0.0f);
  const Image direct = resolve(sums, Formula::direct);
  EXPECT_FLOAT_EQ(direct.at(1, 0)[0], 0.2f);
  EXPECT_FLOAT_EQ(direct.at(1, 0)[3], 0.2f);
  const Image over = overBackground(picture, glm::vec3(0.5f));
  EXPECT_FLOAT_EQ(over.at(0, 0)[2], 0.5f);
  EXPECT_FLOAT_EQ(over.at(1, 0)[2], 0.5f * (1.0f - alpha));
}

}  // namespace
}  // namespace freevoxel
