// Pictures: closed forms, the ray caster, and the two tracers against each other.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>

#include "base/compare.h"
#include "splat/raycast.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/voxlink_scenes.h"
#include "voxlink/gl_buffers.h"
#include "voxlink/trace_rays.h"
#include "voxlink/voxlink.h"

namespace freevoxel {
namespace {

using namespace test;

Image traceCpu(const VoxLinkScene& scene, const Camera& camera, int edge = 8, double threshold = 0.0) {
  const ValueGrid grid = scene.grid();
  VoxLink voxlink(grid, scene.transfer, {.brickEdge = edge, .threshold = threshold}, nullptr, silentProgress());
  return voxlink.trace(camera, silentProgress());
}

// A homogeneous box: alpha is Beer-Lambert's over the way through it.
TEST(Trace, UniformBoxIsTheClosedForm) {
  VoxLinkScene scene = ballAboveAFloor();
  std::fill(scene.volume.data.begin(), scene.volume.data.end(), std::byte(9));
  scene.transfer.points = {{0.0, glm::dvec3(1.0), 0.03}, {255.0, glm::dvec3(1.0), 0.03}};
  const Box box = scene.bounds();
  for (Camera camera : viewsOf(box, 3, {31, 23})) {
    const Image picture = traceCpu(scene, camera);
    const ViewFrame frame = viewFrame(camera);
    for (int y = 0; y < 23; ++y) {
      for (int x = 0; x < 31; ++x) {
        const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
        double enter = 0.0, leave = INFINITY;
        for (int axis = 0; axis < 3; ++axis) {
          const double a = (box.lower[axis] - ray.origin[axis]) / ray.direction[axis];
          const double b = (box.upper[axis] - ray.origin[axis]) / ray.direction[axis];
          enter = std::max(enter, std::min(a, b));
          leave = std::min(leave, std::max(a, b));
        }
        const double alpha = enter < leave ? 1.0 - std::pow(0.97, leave - enter) : 0.0;
        ASSERT_NEAR(picture.at(x, y)[3], alpha, 3e-4) << x << "," << y;
        ASSERT_NEAR(picture.at(x, y)[1], alpha, 3e-4);
      }
    }
  }
}

TEST(Trace, AgreesWithNearestRayCasting) {
  for (const VoxLinkScene& scene : {scatteredScene(), floatScene(), ballAboveAFloor()}) {
    for (const double threshold : {0.0, 0.2}) {
      const ValueGrid grid = scene.grid();
      const ValueGrid visible = onlyStored(grid, storedCodes(scene.transfer, grid.coding, threshold));
      for (const Camera& camera : viewsOf(scene.bounds(), 3, {61, 43})) {
        const Image reference =
            raycast(visible, scene.transfer, camera, {RaycastClassification::nearest, 0.01}, silentProgress());
        EXPECT_GE(compareImages(traceCpu(scene, camera, 8, threshold), reference).psnr, 40.0) << threshold;
      }
    }
  }
}

// Bricks only skip: the picture is the same but for what additions lose.
TEST(Trace, BrickSizeChangesNothing) {
  const VoxLinkScene scene = scatteredScene();
  for (const Camera& camera : viewsOf(scene.bounds(), 3, {61, 43})) {
    const Image four = traceCpu(scene, camera, 4);
    for (const int edge : {8, 16}) {
      const TracerDifference difference = compareTracers(traceCpu(scene, camera, edge), four, 1e-5f);
      EXPECT_EQ(difference.flipped, 0u);
    }
  }
}

TEST(Trace, EyeInsideAndRaysAlongAxes) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  const Box box = scene.bounds();
  gl::Context context;
  VoxLink gpu(grid, scene.transfer, {}, &context, silentProgress());
  for (const glm::dvec3 direction : {glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0)}) {
    for (const bool parallel : {false, true}) {
      Camera camera;
      // An odd size puts the middle pixel's ray exactly on the axis.
      camera.imageSize = {31, 29};
      camera.eye = parallel ? box.centre() - 50.0 * direction : box.centre() + glm::dvec3(0.01, 0.02, 0.03);
      camera.target = camera.eye + direction;
      camera.up = direction.y != 0.0 ? glm::dvec3(0, 0, 1) : glm::dvec3(0, 1, 0);
      if (parallel) camera.orthographicHeight = 9.17;
      const Image picture = traceCpu(scene, camera);
      const Image reference =
          raycast(grid, scene.transfer, camera, {RaycastClassification::nearest, 0.01}, silentProgress());
      EXPECT_GE(compareImages(picture, reference).psnr, 40.0);
      const TracerDifference difference = compareTracers(gpu.trace(camera, silentProgress()), picture, 2e-3f);
      EXPECT_LE(difference.flipped, 3u) << "of " << difference.covered;
    }
  }
  EXPECT_TRUE(context.takeErrors().empty());
}

// Floats put a ray that grazes an edge into the neighbouring voxel now and then. Elsewhere the tracers agree to 2e-3
// (positions of about 1e-6 voxels times the steepest change of opacity); such pixels are few, and brighter as often as
// darker.
TEST(Trace, GpuAgreesWithCpu) {
  gl::Context context;
  for (const VoxLinkScene& scene : {scatteredScene(), floatScene(), ballAboveAFloor()}) {
    const ValueGrid grid = scene.grid();
    for (const int edge : {4, 8, 16}) {
      VoxLink gpu(grid, scene.transfer, {.brickEdge = edge}, &context, silentProgress());
      for (const Camera& camera : viewsOf(scene.bounds(), 3, {121, 97})) {
        const TracerDifference difference =
            compareTracers(gpu.trace(camera, silentProgress()), traceCpu(scene, camera, edge), 2e-3f);
        EXPECT_GT(difference.covered, 400u);
        EXPECT_LE(double(difference.flipped), 2.0 + 2e-3 * double(difference.covered));
        EXPECT_LE(std::abs(difference.meanFlip), 1e-4);
        EXPECT_GE(difference.psnr, 60.0);
      }
    }
  }
  EXPECT_TRUE(context.takeErrors().empty());
}

TEST(Trace, StepsPerPassChangeNoBit) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  const Camera camera = viewsOf(scene.bounds(), 1, {61, 43}).front();
  gl::Context context;
  VoxLink whole(grid, scene.transfer, {.steps = GlVoxLink::kMostSteps}, &context, silentProgress());
  const Image expected = whole.trace(camera, silentProgress());
  EXPECT_EQ(whole.statistics().passes, 1);
  for (const int steps : {1, 2, 7, 40}) {
    VoxLink pieces(grid, scene.transfer, {.steps = steps}, &context, silentProgress());
    EXPECT_EQ(pieces.trace(camera, silentProgress()).pixels, expected.pixels) << steps;
    EXPECT_GT(pieces.statistics().passes, steps < 40 ? 2 : 0) << steps;
  }
  EXPECT_TRUE(context.takeErrors().empty());
}

// From far away float positions would be coarse if they were counted from the eye.
TEST(Trace, GpuSeesFarEyesSharply) {
  const VoxLinkScene scene = ballAboveAFloor();
  const ValueGrid grid = scene.grid();
  Camera camera;
  camera.target = scene.bounds().centre();
  camera.eye = camera.target + glm::dvec3(3e5, 2e5, 4e5);
  camera.verticalFov = 1e-4;
  camera.imageSize = {90, 70};
  gl::Context context;
  VoxLink gpu(grid, scene.transfer, {}, &context, silentProgress());
  const TracerDifference difference =
      compareTracers(gpu.trace(camera, silentProgress()), traceCpu(scene, camera), 1e-2f);
  EXPECT_GT(difference.covered, 1000u);
  EXPECT_LE(double(difference.flipped), 2e-2 * double(difference.covered));
}

}  // namespace
}  // namespace freevoxel
