// Splatted pictures against the reference and against closed forms (issue "the whole line").
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/compare.h"
#include "tests/splat/scene.h"
#include "volume/procedural.h"

namespace freevoxel {
namespace {

using namespace test;

constexpr int kViews = 6;  // bench/fidelity takes 20

/// Lowest PSNR of `normalised` kernels against the pre-classified reference over fixed random views.
/// Images are large enough for a voxel to be wider than a pixel: the reference takes one ray per pixel, while splats
/// are never narrower than one.
double worstPsnr(const Scene& scene, glm::ivec2 imageSize) {
  const ValueGrid grid = scene.grid();
  double worst = INFINITY;
  Progress progress;
  for (const Camera& camera : randomViews(scene.bounds(), kViews, imageSize)) {
    const Image splats = resolve(splatScene(scene, camera, {.footprint = Footprint::kernel}).sums, Formula::normalised);
    const Image reference = raycast(grid, scene.transfer, camera, {RaycastClassification::pre, 0.25}, progress);
    worst = std::min(worst, compareImages(splats, reference).psnr);
  }
  return worst;
}

TEST(Fidelity, UniformCube) {
  const Scene scene =
      makeScene(makeVolume({128, 128, 128}, glm::dvec3(1.0), [](int, int, int) { return 128; }), uniformOpacity(0.02));
  EXPECT_GE(worstPsnr(scene, {448, 360}), 45.0);
}

// Axis view, direct: within one code of 1 - (1 - opacity)^N inside the silhouette (away from it by the kernel's
// radius).
TEST(Fidelity, UniformCubeAlongAnAxis) {
  const Scene scene =
      makeScene(makeVolume({128, 128, 128}, glm::dvec3(1.0), [](int, int, int) { return 128; }), uniformOpacity(0.02));
  const double expected = 1.0 - std::pow(0.98, 128.0);
  SplatOptions options;
  options.formula = Formula::direct;
  options.footprint = Footprint::kernel;
  // 2.5 pixels per voxel, so that the pixels see the kernels' sum at many phases.
  const Camera camera = axisView(scene.bounds(), {340, 335}, 134.0);
  const Image picture = resolve(splatScene(scene, camera, options).sums, Formula::direct);
  double worst = 0.0;
  for (int y = 335 / 2 - 155; y < 335 / 2 + 155; ++y) {
    for (int x = 170 - 155; x < 170 + 155; ++x) {
      worst = std::max(worst, std::abs(double(picture.at(x, y)[0]) - expected));
    }
  }
  EXPECT_LE(worst, 1.0 / 255.0);
}

TEST(Fidelity, Sphere) {
  TransferFunction transfer = whiteRamp(0.05);
  const Scene scene = makeScene(generateVolume("sphere", {96, 80, 88}), transfer);
  EXPECT_GE(worstPsnr(scene, {320, 260}), 38.0);
}

TEST(Fidelity, Cloud) {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.6, 0.7, 1.0), 0.0},
                     {40.0, glm::dvec3(0.6, 0.7, 1.0), 0.0},
                     {255.0, glm::dvec3(1.0, 0.9, 0.8), 0.2}};
  const Scene scene = makeScene(generateVolume("cloud", {96, 80, 112}), transfer);
  EXPECT_GE(worstPsnr(scene, {320, 260}), 38.0);
}

/// A cloud coloured by value: the hardest kind for sums that know no order.
Scene colouredCloud() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                     {30.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                     {90.0, glm::dvec3(0.2, 1.0, 0.2), 0.1},
                     {255.0, glm::dvec3(1.0, 0.1, 0.1), 0.6}};
  return makeScene(generateVolume("cloud", {96, 80, 112}), transfer, 16, Classification::preintegrated);
}

// Cells against the post-classified reference: swept ones beat a ray caster with a step of one voxel, in every view.
TEST(Fidelity, SweptCellsAreMoreAccurateThanRayCastingAtOneVoxel) {
  const Scene scene = colouredCloud();
  const ValueGrid grid = scene.grid();
  Progress progress;
  for (const Camera& camera : randomViews(scene.bounds(), 6, {240, 200})) {
    const Image reference = raycast(grid, scene.transfer, camera, {RaycastClassification::post, 0.125}, progress);
    const Image oneVoxel = raycast(grid, scene.transfer, camera, {RaycastClassification::post, 1.0}, progress);
    const auto psnr = [&](AttenuationSource source) {
      SplatOptions options;
      options.attenuation = source;
      return compareImages(resolve(splatScene(scene, camera, options).sums, Formula::normalised), reference).psnr;
    };
    const double swept = psnr(AttenuationSource::swept);
    EXPECT_GT(swept, compareImages(oneVoxel, reference).psnr);
    EXPECT_GT(swept, 40.0);
    EXPECT_GT(psnr(AttenuationSource::interpolated), 25.0);
  }
}

TEST(Fidelity, EyeInside) {
  const Scene scene = colouredCloud();
  const ValueGrid grid = scene.grid();
  Progress progress;
  for (int i = 0; i < 4; ++i) {
    Camera camera;
    camera.eye = {20.0 + 17.0 * i, 60.0 - 11.0 * i, 30.0 + 19.0 * i};
    camera.target = camera.eye + glm::dvec3(std::sin(2.0 * i), 0.2, std::cos(2.0 * i));
    camera.verticalFov = 1.2;
    camera.imageSize = {160, 120};
    const Image reference = raycast(grid, scene.transfer, camera, {RaycastClassification::post, 0.125}, progress);
    const SplatResult result = splatScene(scene, camera);
    EXPECT_EQ(result.statistics.attenuation, "swept");
    EXPECT_GE(compareImages(resolve(result.sums, Formula::normalised), reference).psnr, 35.0) << i;
  }
}

}  // namespace
}  // namespace freevoxel
