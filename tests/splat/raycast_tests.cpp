// The reference against closed forms.
#include "splat/raycast.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <cstring>
#include <glm/glm.hpp>

#include "base/compare.h"
#include "base/error.h"
#include "tests/splat/scene.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

using namespace test;

constexpr RaycastClassification kAll[] = {RaycastClassification::post, RaycastClassification::pre,
                                          RaycastClassification::nearest};

// A uniform box: alpha is 1 - exp(-sigma * length of the ray inside the box, which reaches half a voxel beyond the
// samples).
TEST(Raycast, UniformBoxIsBeerLambert) {
  Scene scene{makeVolume({5, 7, 11}, {0.3, 1.1, 2.7}, [](int, int, int) { return 200; }), uniformOpacity(0.02),
              nullptr};
  const Box box = scene.bounds();
  const double sigma = -std::log(0.98);
  for (const Camera& camera : randomViews(box, 3, {40, 30})) {
    const ViewFrame frame = viewFrame(camera);
    for (const RaycastClassification classification : {RaycastClassification::post, RaycastClassification::nearest}) {
      const Image picture = raycastScene(scene, camera, {classification, 0.5});
      for (int y = 0; y < 30; ++y) {
        for (int x = 0; x < 40; ++x) {
          const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
          const glm::dvec3 a = (box.lower - ray.origin) / ray.direction, b = (box.upper - ray.origin) / ray.direction;
          const glm::dvec3 near = glm::min(a, b), far = glm::max(a, b);
          const double length = std::max(0.0, std::min({far.x, far.y, far.z}) - std::max({near.x, near.y, near.z}));
          EXPECT_NEAR(picture.at(x, y)[3], -std::expm1(-sigma * length / 0.3), 2e-5);
          EXPECT_NEAR(picture.at(x, y)[0], picture.at(x, y)[3], 2e-6);  // white
        }
      }
    }
  }
}

// Classified before interpolation, the outermost voxels fade out over one voxel, half of it inside the box: what a ray
// along an axis meets in all is the same.
TEST(Raycast, UniformBoxAlongAnAxisIsBeerLambertInAnyClassification) {
  Scene scene{makeVolume({9, 7, 11}, {1.0, 1.1, 1.3}, [](int, int, int) { return 200; }), uniformOpacity(0.05),
              nullptr};
  Camera camera = axisView(scene.bounds(), {5, 5}, 0.5);
  for (const RaycastClassification classification : kAll) {
    const Image picture = raycastScene(scene, camera, {classification, 0.05});
    EXPECT_NEAR(picture.at(2, 2)[3], 1.0 - std::pow(0.95, 11 * 1.3), 1e-4);
  }
}

/// A ball with a sharp rim: the value is the distance from the centre, the transfer function a step at the radius.
Scene ball(double radius) {
  Volume volume;
  volume.header.dims = {49, 51, 53};
  volume.header.type = ValueType::f32;
  volume.header.placement.origin = {-24.0, -25.0, -26.0};
  volume.data.resize(volume.header.bytes());
  float* values = reinterpret_cast<float*>(volume.data.data());
  for (int z = 0; z < 53; ++z) {
    for (int y = 0; y < 51; ++y) {
      for (int x = 0; x < 49; ++x) {
        values[linearIndex({x, y, z}, volume.header.dims)] = float(std::hypot(x - 24.0, y - 25.0, z - 26.0));
      }
    }
  }
  TransferFunction transfer;
  transfer.low = 0.0;
  transfer.high = 50.0;
  transfer.points = {{0.0, glm::dvec3(1.0, 0.5, 0.2), 0.05},
                     {radius, glm::dvec3(1.0, 0.5, 0.2), 0.05},
                     {radius, glm::dvec3(1.0, 0.5, 0.2), 0.0},
                     {50.0, glm::dvec3(1.0, 0.5, 0.2), 0.0}};
  return {std::move(volume), transfer, nullptr};
}

TEST(Raycast, HomogeneousBallIsBeerLambert) {
  const double radius = 20.0;
  const Scene scene = ball(radius);
  const double sigma = -std::log(0.95);
  const Camera camera = randomViews(scene.bounds(), 1, {60, 50}).front();
  const ViewFrame frame = viewFrame(camera);
  const Image picture = raycastScene(scene, camera, {RaycastClassification::post, 0.0625});
  double worst = 0.0;
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 60; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
      const double b = glm::dot(ray.origin, ray.direction);
      const double square = b * b - glm::dot(ray.origin, ray.origin) + radius * radius;
      const double chord = square > 0.0 ? 2.0 * std::sqrt(square) : 0.0;
      worst = std::max(worst, std::abs(double(picture.at(x, y)[3]) + std::expm1(-sigma * chord)));
    }
  }
  // Near the rim a chord changes by sqrt(8 r d) for a distance error d; trilinear distances at this radius are off by
  // up to 1/(8 r) voxel squared over two, 0.006: chords by 1 there, alpha by 0.05. Elsewhere it is far less: see the
  // mean.
  EXPECT_LT(worst, 0.05);
  double sum = 0.0;
  int inside = 0;
  for (int y = 0; y < 50; ++y) {
    for (int x = 0; x < 60; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
      const double b = glm::dot(ray.origin, ray.direction);
      const double square = b * b - glm::dot(ray.origin, ray.origin) + radius * radius;
      if (square < 40.0) continue;
      sum += std::abs(double(picture.at(x, y)[3]) + std::expm1(-sigma * 2.0 * std::sqrt(square)));
      ++inside;
    }
  }
  ASSERT_GT(inside, 300);
  EXPECT_LT(sum / inside, 1e-3);
}

TEST(Raycast, HalvingTheStepChangesLittle) {
  const Scene scene = awkwardScene();
  const Camera camera = randomViews(scene.bounds(), 1, {80, 60}).front();
  for (const RaycastClassification classification : kAll) {
    // As DESIGN section 3 asks: the PSNR of any picture against this reference moves by less than 0.05 dB. The splats
    // are the picture.
    const Image splats = resolve(splatScene(scene, camera).sums, Formula::normalised);
    const Image coarse = raycastScene(scene, camera, {classification, 0.125});
    const Image fine = raycastScene(scene, camera, {classification, 0.0625});
    EXPECT_LT(std::abs(compareImages(splats, coarse).psnr - compareImages(splats, fine).psnr), 0.05);
    if (classification != RaycastClassification::nearest) {
      EXPECT_GT(compareImages(coarse, fine).psnr, 55.0);
    }
  }
}

TEST(Raycast, SameBytesForAnyThreadCount) {
  const Scene scene = awkwardScene();
  const Camera camera = randomViews(scene.bounds(), 1, {33, 21}).front();
  const int before = omp_get_max_threads();
  omp_set_num_threads(1);
  const Image one = raycastScene(scene, camera);
  omp_set_num_threads(3);
  const Image three = raycastScene(scene, camera);
  omp_set_num_threads(before);
  EXPECT_EQ(std::memcmp(one.pixels.data(), three.pixels.data(), one.pixels.size() * sizeof(float)), 0);
}

// Casting the values an attenuation file stored gives the picture that the volume itself gives.
TEST(Raycast, StoredBricksSuffice) {
  const Scene scene = makeScene(
      makeVolume(
          {40, 21, 30}, {1.0, 1.3, 0.7},
          [](int x, int y, int z) { return std::hypot(x - 12.0, y - 10.0, z - 9.0) < 6.5 ? 140 + x : 20 + x % 7; }),
      uniformOpacity(0.0), 8);
  Scene banded{scene.volume, {}, nullptr};
  banded.transfer.points = {{0.0, glm::dvec3(1.0), 0.0},
                            {100.0, glm::dvec3(1.0, 0.5, 0.0), 0.0},
                            {120.0, glm::dvec3(1.0), 0.4},
                            {255.0, glm::dvec3(0.0, 0.5, 1.0), 0.3}};
  const Scene stored = makeScene(banded.volume, banded.transfer, 8);
  ASSERT_LT(stored.file->brickCount(), 5u * 3u * 4u) << "the test wants absent bricks";
  for (const Camera& camera : randomViews(stored.bounds(), 2, {50, 40})) {
    for (const RaycastClassification classification : kAll) {
      const RaycastOptions options{classification, 0.25};
      const Image whole = raycastScene(stored, camera, options);
      const Image part = raycast(valueGrid(*stored.file), stored.transfer, camera, options, silentProgress());
      EXPECT_GT(compareImages(whole, part).psnr, 110.0);
    }
  }
}

TEST(Raycast, EyeInsideSeesOnlyWhatIsAhead) {
  Scene scene{makeVolume({9, 9, 21}, glm::dvec3(1.0), [](int, int, int) { return 200; }), uniformOpacity(0.1), nullptr};
  Camera camera;
  camera.eye = {4.0, 4.0, 10.0};
  camera.target = {4.0, 4.0, 0.0};
  camera.imageSize = {3, 3};
  camera.verticalFov = 0.01;
  const Image picture = raycastScene(scene, camera);
  EXPECT_NEAR(picture.at(1, 1)[3], 1.0 - std::pow(0.9, 10.5), 1e-5);
}

// An opaque plate between lamp and floor: its shadow, and nothing else, is dark.
TEST(Raycast, MarchesShadows) {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(1.0), 0.0}, {1.0, glm::dvec3(1.0), 0.0}, {100.0, glm::dvec3(1.0), 1.0}};
  const Volume volume = makeVolume({41, 33, 21}, glm::dvec3(1.0), [](int x, int y, int z) {
    const bool plate = z == 15 && x >= 14 && x < 27 && y >= 10 && y < 23;
    return plate || z <= 2 ? 255 : 0;
  });
  const ValueGrid grid = valueGrid(volume, transfer);
  RaycastOptions options;
  options.lighting.ambient = 0.25f;
  options.lighting.lights = {{true, {0.0, 0.0, 1.0}, glm::vec3(0.5f)}};
  // From the side and above, so that the floor beneath the plate is seen.
  Camera camera;
  camera.eye = {20.0, -60.0, 40.0};
  camera.target = {20.0, 16.0, 3.0};
  camera.up = {0.0, 0.0, 1.0};
  camera.imageSize = {160, 120};
  const Image lit = raycast(grid, transfer, camera, options, silentProgress());
  const ViewFrame frame = viewFrame(camera);
  const auto lightAt = [&](glm::dvec3 world) {
    const glm::ivec2 pixel(project(frame, world)->pixel);
    return lit.at(pixel.x, pixel.y)[0];
  };
  EXPECT_NEAR(lightAt({20.0, 12.0, 2.5}), 0.25, 0.02) << "beneath the plate: ambient light only";
  // Matter shadows itself: with the eye at an angle whose cosine is 0.46, light that falls straight down loses
  // 1 - 1 / (1 + 0.46) of itself on the way to the depths that the eye sees, if extinction is constant there.
  EXPECT_NEAR(lightAt({5.0, 12.0, 2.5}), 0.25 + 0.5 / 1.46, 0.05) << "beside it";
  options.lighting.lights.clear();
  options.lighting.ambient = 1.0f;
  EXPECT_NEAR(raycast(grid, transfer, camera, options, silentProgress()).at(80, 60)[3], 1.0f, 1e-6);
}

TEST(Raycast, TransmittanceOfAUniformBoxIsBeerLambert) {
  const Volume volume = makeVolume({25, 17, 21}, {1.0, 1.5, 2.0}, [](int, int, int) { return 255; });
  const TransferFunction transfer = uniformOpacity(0.05);
  const ValueGrid grid = valueGrid(volume, transfer);
  const std::vector<glm::dvec3> positions = {{12.0, 8.0, 10.0}, {0.0, 0.0, 0.0}, {24.0, 3.0, 20.0}};
  const std::vector<float> found =
      marchTransmittance(grid, transfer, positions, Towards::direction(grid.placement, {0.0, 1.0, 0.0}), 0.1);
  for (size_t i = 0; i < positions.size(); ++i) {
    const double length = (16.5 - positions[i].y) * 1.5;
    EXPECT_NEAR(found[i], std::pow(0.95, length), 1e-4);
  }
  // A lamp 3 voxels away: no further.
  EXPECT_NEAR(marchTransmittance(grid, transfer, std::vector<glm::dvec3>{{12.0, 8.0, 10.0}},
                                 Towards::point(grid.placement, {15.0, 12.0, 20.0}), 0.1)
                  .front(),
              std::pow(0.95, 3.0), 1e-4);
}

TEST(Raycast, StepMustBePositive) {
  const Scene scene = awkwardScene();
  const Camera camera = randomViews(scene.bounds(), 1, {3, 3}).front();
  for (const double step : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    EXPECT_THROW(raycastScene(scene, camera, {RaycastClassification::post, step}), InputError);
  }
}

}  // namespace
}  // namespace freevoxel
