// Pinned attenuation: swept once, and the same bits as sweeping again.
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "precompute/precompute.h"
#include "splat/pinned_attenuation.h"
#include "tests/splat/scene.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

using namespace test;

/// Mist round an opaque ball off the middle.
Scene ballInMist(Layout layout, const std::vector<Pin>& pins) {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.2, 0.4, 1.0), 0.0},
                     {20.0, glm::dvec3(0.2, 0.4, 1.0), 0.0},
                     {100.0, glm::dvec3(0.3, 1.0, 0.4), 0.05},
                     {255.0, glm::dvec3(1.0, 0.5, 0.2), 0.9}};
  Scene scene{makeVolume({37, 29, 33}, {1.0, 1.1, 0.8},
                         [](int x, int y, int z) {
                           const double r = glm::length(glm::dvec3(x, y, z) - glm::dvec3(15, 12, 18));
                           return r < 6.0 ? 255 : r < 11.0 ? 60 + (x * 3 + y * 5 + z * 7) % 50 : 0;
                         }),
              transfer, nullptr};
  const std::string plain = temporaryFolder() + "/plain.fvx", path = temporaryFolder() + "/pinned.fvx";
  PrecomputeOptions options;
  options.layout = layout;
  options.brickEdge = 8;
  precompute(scene.volume, scene.transfer, plain, options, silentProgress());
  pinAttenuation(plain, pins, path, silentProgress());
  scene.file = std::make_unique<AttenuationFile>(path);
  return scene;
}

const Pin kFar{true, {0.4, 1.0, -0.7}}, kNear{false, {60.0, 20.0, 40.0}}, kInside{false, {4.0, 3.0, 5.0}};

class PinnedAttenuation : public testing::TestWithParam<Layout> {};
INSTANTIATE_TEST_SUITE_P(Layouts, PinnedAttenuation, testing::Values(Layout::dense, Layout::compact),
                         [](const auto& tested) { return std::string(layoutName(tested.param)); });

TEST_P(PinnedAttenuation, IsTheSweepToTheBit) {
  const Scene scene = ballInMist(GetParam(), {kFar, kNear, kInside});
  scene.file->verify();
  const ValueGrid grid = valueGrid(*scene.file);
  const ClassificationTable table = classificationTable(scene.transfer, grid.coding);
  const VisibleCubes cubes = findVisibleCubes(grid, scene.transfer);
  for (size_t i = 0; i < 3; ++i) {
    const Towards target = towardsPin(scene.file->pinned().pins()[i], grid.placement);
    const AttenuationGrid swept = sweptAttenuation(grid, table, cubes, target);
    const AttenuationGrid pinned = pinnedAttenuation(*scene.file, i);
    EXPECT_EQ(pinned.values, swept.values);
    EXPECT_EQ(pinned.openLow, swept.openLow);
    EXPECT_EQ(pinned.openHigh, swept.openHigh);
    EXPECT_LT(*std::min_element(swept.values.begin(), swept.values.end()), 100) << "the ball casts a shadow";
  }
}

/// Eye and lamps pinned: the picture is that of sweeps, whatever the order, the threads and the backend.
TEST_P(PinnedAttenuation, MakesThePictureOfSweeps) {
  Camera camera;
  camera.eye = kNear.world;
  camera.target = {18.0, 15.0, 12.0};
  camera.imageSize = {57, 43};
  const Scene scene = ballInMist(GetParam(), {kFar, kNear, kInside});
  for (const Footprint footprint : {Footprint::cell, Footprint::kernel}) {
    for (const Cull cull : {Cull::none, Cull::hidden}) {
      SplatOptions options;
      options.footprint = footprint;
      options.cull = cull;
      options.lighting.ambient = 0.1f;
      options.lighting.lights = {{true, kFar.world, {1.0f, 0.3f, 0.2f}}, {false, kInside.world, {0.1f, 0.2f, 2.0f}}};
      options.attenuation = options.lightAttenuation = AttenuationSource::swept;
      const SplatResult swept = splatScene(scene, camera, options);
      options.attenuation = options.lightAttenuation = AttenuationSource::pinned;
      const int threads = omp_get_max_threads();
      int count = 0;
      for (const Backend backend : {Backend::cpu, Backend::gl}) {
        for (const SplatOrder order :
             {SplatOrder{SplatOrder::Kind::reverse, 0}, SplatOrder{SplatOrder::Kind::shuffle, 7}}) {
          options.order = order;
          omp_set_num_threads(1 + count++ % 3);
          const SplatResult pinned = splatScene(scene, camera, options, backend);
          EXPECT_EQ(pinned.sums.image.pixels, swept.sums.image.pixels);
          EXPECT_EQ(pinned.statistics.attenuation, "pinned");
          EXPECT_EQ(pinned.statistics.lightAttenuation, "pinned");
        }
      }
      omp_set_num_threads(threads);
    }
  }
}

TEST(Pins, AreFoundByTargetAndTakenByThemselves) {
  const Scene scene = ballInMist(Layout::dense, {kFar, kNear});
  const Placement& placement = scene.file->placement();
  EXPECT_EQ(findPin(*scene.file, Towards::direction(placement, kFar.world * 3.0)), size_t(0)) << "of any length";
  EXPECT_EQ(findPin(*scene.file, Towards::direction(placement, -kFar.world)), std::nullopt);
  EXPECT_EQ(findPin(*scene.file, Towards::direction(placement, kFar.world + glm::dvec3(1e-6))), std::nullopt);
  EXPECT_EQ(findPin(*scene.file, Towards::point(placement, kFar.world)), std::nullopt) << "a point, not a direction";
  EXPECT_EQ(findPin(*scene.file, Towards::point(placement, kNear.world)), size_t(1));
  EXPECT_EQ(findPin(*scene.file, Towards::point(placement, kNear.world + glm::dvec3(1e-5))), std::nullopt);

  Camera camera = orbitCamera(scene.bounds(), Orbit{}, {40, 30}, 0.5, 50.0);
  camera.eye = camera.target + 40.0 * kFar.world;
  SplatOptions options;
  options.lighting.lights = {{false, kNear.world, glm::vec3(1.0f)}};
  const SplatResult taken = splatScene(scene, camera, options);
  EXPECT_EQ(taken.statistics.attenuation, "pinned") << "parallel rays towards a pinned direction";
  EXPECT_EQ(taken.statistics.lightAttenuation, "pinned");
  options.lighting.lights[0].world += glm::dvec3(1.0);
  EXPECT_EQ(splatScene(scene, camera, options).statistics.lightAttenuation, "stored");
  options.lightAttenuation = AttenuationSource::pinned;
  EXPECT_THROW(splatScene(scene, camera, options), InputError);
}

/// Pins hold attenuation and no colour.
TEST(Pins, StayGoodWhenColoursChange) {
  Scene scene = ballInMist(Layout::dense, {kFar});
  SplatOptions options;
  options.lighting.lights = {{true, kFar.world, glm::vec3(1.0f)}};
  const Camera camera = randomViews(scene.bounds(), 1, {40, 30}).front();
  const Image before = resolve(splatScene(scene, camera, options).sums, options.formula);
  for (TransferPoint& point : scene.transfer.points)
    point.srgb = glm::dvec3(point.srgb.b, point.srgb.r, point.srgb.g);
  const SplatResult after = splatScene(scene, camera, options);
  EXPECT_EQ(after.statistics.lightAttenuation, "pinned");
  EXPECT_NE(resolve(after.sums, options.formula).pixels, before.pixels);
}

}  // namespace
}  // namespace freevoxel
