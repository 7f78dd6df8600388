// Edits of the transfer function, and options that make no sense.
#include "voxlink/voxlink.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/voxlink_scenes.h"
#include "voxlink/gl_buffers.h"

namespace freevoxel {
namespace {

using namespace test;

Lighting oneLamp() {
  Lighting lighting;
  lighting.ambient = 0.2f;
  lighting.lights = {{true, {1.0, 1.0, 0.3}, {1.0f, 0.8f, 0.7f}}};
  return lighting;
}

/// Edits `scene` to `edited` and compares with a fresh one.
void expectEditedLikeRebuilt(const gl::Context* context, const VoxLinkScene& scene, const TransferFunction& edited,
                             int expectedBuilds, double threshold = 0.0) {
  const ValueGrid grid = scene.grid(), editedGrid = valueGrid(scene.volume, edited);
  VoxLink voxlink(grid, scene.transfer, {.threshold = threshold}, context, silentProgress());
  voxlink.light(oneLamp(), Shadows::attenuation);
  voxlink.edit(editedGrid, edited, silentProgress());
  EXPECT_EQ(voxlink.statistics().builds, expectedBuilds);
  VoxLink fresh(editedGrid, edited, {.threshold = threshold}, context, silentProgress());
  fresh.light(oneLamp(), Shadows::attenuation);
  for (const Camera& camera : viewsOf(scene.bounds(), 3, {61, 43})) {
    const Image found = voxlink.trace(camera, silentProgress()), expected = fresh.trace(camera, silentProgress());
    const TracerDifference difference = compareTracers(found, expected, 1e-4f);
    EXPECT_GT(difference.covered, 50u);
    EXPECT_LE(difference.flipped, 1u);  // other bricks are skipped, so a float may round otherwise
  }
}

TEST(Edit, WithinWhatIsStoredNeedsNoRebuild) {
  const VoxLinkScene scene = scatteredScene();
  TransferFunction edited = scene.transfer;
  edited.points[1] = {190.0, glm::dvec3(1.0, 0.1, 0.8), 0.0};  // hides some, recolours and thins the rest
  edited.points[2].opacity = 0.3;
  edited.points[2].srgb = glm::dvec3(0.2, 1.0, 0.1);
  gl::Context context;
  for (const gl::Context* backend :
       {static_cast<const gl::Context*>(nullptr), static_cast<const gl::Context*>(&context)})
    expectEditedLikeRebuilt(backend, scene, edited, 1);
}

TEST(Edit, ThatShowsMoreRebuilds) {
  const VoxLinkScene scene = scatteredScene();
  TransferFunction edited = scene.transfer;
  edited.points[1].value = 120.0;
  gl::Context context;
  for (const gl::Context* backend :
       {static_cast<const gl::Context*>(nullptr), static_cast<const gl::Context*>(&context)})
    expectEditedLikeRebuilt(backend, scene, edited, 2);
}

TEST(Edit, OfOpacityBelowTheThresholdHides) {
  const VoxLinkScene scene = scatteredScene();
  TransferFunction edited = scene.transfer;
  edited.points[2].opacity = 0.5;  // some that were above 0.2 no longer are
  expectEditedLikeRebuilt(nullptr, scene, edited, 1, 0.2);
}

TEST(Edit, OfTheRangeRebuilds) {
  const VoxLinkScene scene = scatteredScene();
  TransferFunction edited = scene.transfer;
  edited.high = 240.0;
  expectEditedLikeRebuilt(nullptr, scene, edited, 2);
}

// A value that nothing has may become visible without anything to add.
TEST(Edit, OfValuesThatDoNotOccurNeedsNoRebuild) {
  VoxLinkScene scene = ballAboveAFloor();
  TransferFunction edited = scene.transfer;
  scene.transfer.points = {{0.0, glm::dvec3(1.0), 0.0}, {254.0, glm::dvec3(1.0), 0.0}, {255.0, glm::dvec3(1.0), 0.9}};
  expectEditedLikeRebuilt(nullptr, scene, edited, 1);
}

TEST(VoxLinkOptions, AreChecked) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  const auto make = [&](const VoxLinkOptions& options) {
    VoxLink(grid, scene.transfer, options, nullptr, silentProgress());
  };
  EXPECT_THROW(make({.brickEdge = 3}), InputError);
  EXPECT_THROW(make({.threshold = 1.0}), InputError);
  EXPECT_THROW(make({.threshold = -0.1}), InputError);
  EXPECT_THROW(make({.threshold = 0.95}), InputError) << "nothing is so opaque";
  EXPECT_THROW(make({.steps = 0}), InputError);
  EXPECT_THROW(make({.steps = GlVoxLink::kMostSteps + 1}), InputError);
}

TEST(VoxLinkStatistics, CountEverything) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  gl::Context context;
  for (const gl::Context* backend :
       {static_cast<const gl::Context*>(nullptr), static_cast<const gl::Context*>(&context)}) {
    VoxLink voxlink(grid, scene.transfer, {.brickEdge = 4}, backend, silentProgress());
    const VoxLinkStatistics& statistics = voxlink.statistics();
    const VoxLinkBuffers buffers = buildBuffers(grid, storedCodes(scene.transfer, grid.coding, 0.0), 4);
    EXPECT_EQ(statistics.bufferBytes, buffers.bytes(256));
    EXPECT_EQ(statistics.storedVoxels, buffers.fragments.size());
    EXPECT_EQ(statistics.bricks, uint64_t(4 * 8 * 2));
    EXPECT_EQ(statistics.voxels, uint64_t(13 * 29 * 7));
  }
}

}  // namespace
}  // namespace freevoxel
