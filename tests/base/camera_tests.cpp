// Where world points land, by hand.
#include "base/camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "base/error.h"

namespace freevoxel {
namespace {

constexpr double kPi = std::numbers::pi;

Camera lookingDownZ() {
  Camera camera;
  camera.eye = {0.0, 0.0, 10.0};
  camera.target = {0.0, 0.0, 0.0};
  camera.verticalFov = 0.5 * kPi;  // at depth z the image is 2z high
  camera.imageSize = {300, 200};   // so at depth 10 one unit is 10 pixels
  return camera;
}

void expectPixel(const ViewFrame& frame, glm::dvec3 world, glm::dvec2 pixel, double depth) {
  const std::optional<Projected> projected = project(frame, world);
  ASSERT_TRUE(projected.has_value());
  EXPECT_NEAR(projected->pixel.x, pixel.x, 1e-9);
  EXPECT_NEAR(projected->pixel.y, pixel.y, 1e-9);
  EXPECT_NEAR(projected->depth, depth, 1e-9);
}

TEST(Camera, perspectiveProjectsByHand) {
  const ViewFrame frame = viewFrame(lookingDownZ());
  expectPixel(frame, {0.0, 0.0, 0.0}, {150.0, 100.0}, 10.0);
  expectPixel(frame, {3.0, 0.0, 0.0}, {180.0, 100.0}, 10.0);   // x to the right
  expectPixel(frame, {0.0, 3.0, 0.0}, {150.0, 70.0}, 10.0);    // y up, rows downwards
  expectPixel(frame, {3.0, 3.0, 5.0}, {210.0, 40.0}, 5.0);     // twice as near, twice as large
  EXPECT_FALSE(project(frame, {0.0, 0.0, 10.0}).has_value());  // on the eye's plane
  EXPECT_FALSE(project(frame, {1.0, 0.0, 11.0}).has_value());  // behind
}

TEST(Camera, orthographicProjectsByHand) {
  Camera camera = lookingDownZ();
  camera.orthographicHeight = 50.0;  // 4 pixels per unit
  const ViewFrame frame = viewFrame(camera);
  expectPixel(frame, {3.0, 3.0, 5.0}, {162.0, 88.0}, 5.0);
  expectPixel(frame, {3.0, 3.0, 11.0}, {162.0, 88.0}, -1.0);  // behind the eye, still on a pixel
}

TEST(Camera, axesOfATurnedCamera) {
  Camera camera = lookingDownZ();
  camera.eye = {10.0, 0.0, 0.0};  // looks along -x: y stays up, -z is to the right
  const ViewFrame frame = viewFrame(camera);
  expectPixel(frame, {0.0, 0.0, -3.0}, {180.0, 100.0}, 10.0);
  expectPixel(frame, {0.0, 3.0, 0.0}, {150.0, 70.0}, 10.0);
}

TEST(Camera, pixelRayIsTheInverseOfProject) {
  for (const bool orthographic : {false, true}) {
    Camera camera = lookingDownZ();
    camera.eye = {4.0, -7.0, 3.0};
    camera.target = {-1.0, 2.0, 0.5};
    camera.up = {0.1, 0.2, 1.0};
    if (orthographic) camera.orthographicHeight = 7.0;
    const ViewFrame frame = viewFrame(camera);
    for (const glm::dvec2 pixel : {glm::dvec2(0.5, 0.5), {150.0, 100.0}, {17.25, 180.5}, {299.5, 199.5}}) {
      const Ray ray = pixelRay(frame, pixel);
      EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-12);
      for (const double distance : {0.1, 1.0, 50.0}) {
        const std::optional<Projected> projected = project(frame, ray.origin + distance * ray.direction);
        ASSERT_TRUE(projected.has_value());
        EXPECT_NEAR(projected->pixel.x, pixel.x, 1e-8);
        EXPECT_NEAR(projected->pixel.y, pixel.y, 1e-8);
        EXPECT_GT(projected->depth, 0.0);
      }
    }
  }
}

TEST(Camera, refusesWhatHasNoImage) {
  const Camera good = lookingDownZ();
  EXPECT_NO_THROW(checkCamera(good));
  Camera camera = good;
  camera.target = camera.eye;
  EXPECT_THROW(checkCamera(camera), InputError);
  camera = good;
  camera.up = {0.0, 0.0, 2.0};
  EXPECT_THROW(checkCamera(camera), InputError);
  camera = good;
  camera.up = glm::dvec3(0.0);
  EXPECT_THROW(checkCamera(camera), InputError);
  camera = good;
  camera.eye.x = NAN;
  EXPECT_THROW(checkCamera(camera), InputError);
  for (const double fov : {0.0, -1.0, kPi, double(NAN)}) {
    camera = good;
    camera.verticalFov = fov;
    EXPECT_THROW(checkCamera(camera), InputError) << fov;
  }
  for (const double height : {0.0, -1.0, double(INFINITY)}) {
    camera = good;
    camera.orthographicHeight = height;
    EXPECT_THROW(checkCamera(camera), InputError) << height;
  }
  for (const glm::ivec2 size : {glm::ivec2(0, 5), {5, -1}, {40000, 5}}) {
    camera = good;
    camera.imageSize = size;
    EXPECT_THROW(checkCamera(camera), InputError) << size.x;
  }
}

const Box kBox{{-1.0, 2.0, 3.0}, {4.0, 9.0, 14.0}};  // 5 x 7 x 11

TEST(OrbitCamera, startsLookingAlongMinusZ) {
  const Camera camera = orbitCamera(kBox, {}, {300, 200}, kPi / 6.0, std::nullopt);
  const glm::dvec3 forward = glm::normalize(camera.target - camera.eye);
  EXPECT_NEAR(glm::distance(camera.target, kBox.centre()), 0.0, 1e-12);
  EXPECT_NEAR(glm::distance(forward, glm::dvec3(0.0, 0.0, -1.0)), 0.0, 1e-12);
  EXPECT_EQ(camera.up, glm::dvec3(0.0, 1.0, 0.0));
}

TEST(OrbitCamera, azimuthTurnsAboutYAndElevationRises) {
  const Camera right = orbitCamera(kBox, {0.5 * kPi, 0.0, 20.0}, {300, 200}, kPi / 6.0, std::nullopt);
  EXPECT_NEAR(glm::distance(right.eye, kBox.centre() + glm::dvec3(20.0, 0.0, 0.0)), 0.0, 1e-12);
  const Camera above = orbitCamera(kBox, {0.0, kPi / 6.0, 20.0}, {300, 200}, kPi / 6.0, std::nullopt);
  EXPECT_NEAR(above.eye.y - kBox.centre().y, 10.0, 1e-12);
}

TEST(OrbitCamera, framesTheWholeBox) {
  for (const glm::ivec2 size : {glm::ivec2(300, 200), {123, 456}}) {
    for (const bool orthographic : {false, true}) {
      for (const double elevation : {-0.5 * kPi, -0.4, 0.0, 0.9, 0.5 * kPi}) {
        const std::optional<double> height = orthographic ? std::optional<double>(0.0) : std::nullopt;
        const Camera camera = orbitCamera(kBox, {0.7, elevation, std::nullopt}, size, kPi / 6.0, height);
        const ViewFrame frame = viewFrame(camera);  // straight up and down have a usable `up`
        for (int corner = 0; corner < 8; ++corner) {
          const glm::dvec3 world((corner & 1) ? kBox.upper.x : kBox.lower.x, (corner & 2) ? kBox.upper.y : kBox.lower.y,
                                 (corner & 4) ? kBox.upper.z : kBox.lower.z);
          const std::optional<Projected> projected = project(frame, world);
          ASSERT_TRUE(projected.has_value());
          EXPECT_GE(projected->pixel.x, 0.0);
          EXPECT_GE(projected->pixel.y, 0.0);
          EXPECT_LE(projected->pixel.x, size.x);
          EXPECT_LE(projected->pixel.y, size.y);
        }
      }
    }
  }
}

}  // namespace
}  // namespace freevoxel
