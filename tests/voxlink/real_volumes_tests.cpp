// Real volumes through VoxLink: exact buffers, agreement with the ray caster, bytes per voxel.
#include <gtest/gtest.h>

#include "base/compare.h"
#include "splat/raycast.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/voxlink_scenes.h"
#include "volume/procedural.h"
#include "volume/read_volume.h"
#include "voxlink/gl_buffers.h"
#include "voxlink/trace_rays.h"
#include "voxlink/voxlink.h"

namespace freevoxel {
namespace {

using namespace test;

VoxLinkScene realScene(const std::string& name) {
  VoxLinkScene scene;
  scene.transfer = readTransferFunction(sourceFolder() + "/examples/transfer/" + name + ".json");
  if (name == "cloud") {
    scene.volume = generateVolume("cloud", {96, 80, 112});
    return scene;
  }
  VolumeOptions options;
  std::string file = "carp.nii.gz";
  if (name == "cthead") {
    file = "cthead_256x256x113_uint16_be.raw.gz";
    options = {.dims = glm::ivec3(256, 256, 113),
               .type = ValueType::u16,
               .byteOrder = ByteOrder::big,
               .spacing = glm::dvec3(1.0, 1.0, 2.0)};
  }
  if (name == "aneurism") {
    file = "aneurism_256x256x256_uint8.raw.gz";
    options = {.dims = glm::ivec3(256, 256, 256), .type = ValueType::u8};
  }
  scene.volume = readVolume(*dataFolder() + "/volumes/" + file, options);
  return scene;
}

void expectAgreement(const VoxLinkScene& scene) {
  const ValueGrid grid = scene.grid();
  gl::Context context;
  VoxLink cpu(grid, scene.transfer, {}, nullptr, silentProgress());
  VoxLink gpu(grid, scene.transfer, {}, &context, silentProgress());
  for (const Camera& camera : viewsOf(scene.bounds(), 3, {140, 110})) {
    const Image picture = cpu.trace(camera, silentProgress());
    const Image reference =
        raycast(grid, scene.transfer, camera, {RaycastClassification::nearest, 0.05}, silentProgress());
    EXPECT_GE(compareImages(picture, reference).psnr, 40.0);
    const TracerDifference difference = compareTracers(gpu.trace(camera, silentProgress()), picture, 2e-3f);
    EXPECT_LE(double(difference.flipped), 2.0 + 2e-3 * double(difference.covered));
    EXPECT_LE(std::abs(difference.meanFlip), 1e-4);
    EXPECT_GE(difference.psnr, 60.0);
  }
  EXPECT_TRUE(context.takeErrors().empty());
}

TEST(RealVolumes, CloudAgreesWithNearestRayCasting) {
  expectAgreement(realScene("cloud"));
}

TEST(RealVolumes, CarpAgreesWithNearestRayCasting) {
  if (!dataFolder()) GTEST_SKIP() << kNoData;
  expectAgreement(realScene("carp"));
}

TEST(RealVolumes, CtHeadAgreesWithNearestRayCasting) {
  if (!dataFolder()) GTEST_SKIP() << kNoData;
  expectAgreement(realScene("cthead"));
}

TEST(RealVolumes, BuffersOfTheCarpHoldWhatAPlainLoopFinds) {
  if (!dataFolder()) GTEST_SKIP() << kNoData;
  const VoxLinkScene scene = realScene("carp");
  const ValueGrid grid = scene.grid();
  const double threshold = 0.1;
  const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, threshold);
  gl::Context context;
  GlVoxLink gpu(context, uint64_t(1) << 30);
  gpu.build(grid, stored, 8, silentProgress());
  const VoxLinkBuffers found = gpu.download();
  EXPECT_EQ(voxelsIn(found), plainLoop(grid, scene.transfer, threshold));
  EXPECT_EQ(found.brickHeaders, buildBuffers(grid, stored, 8).brickHeaders);
}

// At 0.5 to 2 % filled the paper's lists take 17 to 21 bytes a voxel.
TEST(RealVolumes, SparseOnesTakeFewBytes) {
  if (!dataFolder()) GTEST_SKIP() << kNoData;
  const VoxLinkScene scene = realScene("aneurism");
  const ValueGrid grid = scene.grid();
  for (const int edge : {4, 8}) {
    VoxLink voxlink(grid, scene.transfer, {.brickEdge = edge}, nullptr, silentProgress());
    const VoxLinkStatistics& statistics = voxlink.statistics();
    const double filled = double(statistics.storedVoxels) / double(statistics.voxels);
    EXPECT_GT(filled, 0.004);
    EXPECT_LT(filled, 0.02);
    EXPECT_LE(double(statistics.bufferBytes) / double(statistics.storedVoxels), 12.0) << edge;
  }
}

}  // namespace
}  // namespace freevoxel
