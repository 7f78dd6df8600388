// The real meshes voxelised on the GPU and by plain C++: the same bytes, and few of them.
#include <gtest/gtest.h>

#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "tests/voxlink/voxlink_scenes.h"
#include "voxlink/gl_scene.h"
#include "voxlink/read_mesh.h"

namespace freevoxel {
namespace {

using namespace test;

TracedScene sceneOf(const std::string& name) {
  TracedScene scene;
  scene.mesh = readMesh(*dataFolder() + "/meshes/" + name).mesh;
  return scene;
}

class RealScenes : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!dataFolder()) GTEST_SKIP() << kNoData;
  }
  TestReader reader;
};

TEST_P(RealScenes, GpuVoxelsAreTheCpus) {
  const TracedScene scene = sceneOf(GetParam());
  gl::Context context;
  GlScene gpu(context, uint64_t(4) << 30, 1 << 20);
  for (const int resolution : {128, 256}) {
    const SceneVoxels voxels = sceneVoxels(scene, sceneGrid(sceneBounds(scene), resolution), 0.0);
    uint64_t expectedDegenerate = 0, degenerate = 0;
    const SceneBuffers expected = buildSceneBuffers(voxels, 8, expectedDegenerate);
    gpu.build(voxels, 8, degenerate, silentProgress());
    const SceneBuffers found = gpu.download();
    EXPECT_EQ(degenerate, expectedDegenerate);
    EXPECT_EQ(found.brickHeaders, expected.brickHeaders);
    EXPECT_EQ(found.voxels, expected.voxels);
    ASSERT_EQ(found.fragments.size(), expected.fragments.size());
    uint64_t different = 0;
    for (size_t i = 0; i < found.fragments.size(); ++i) {
      different +=
          found.fragments[i].head != expected.fragments[i].head || found.fragments[i].body != expected.fragments[i].body
              ? 1
              : 0;
    }
    EXPECT_EQ(different, 0u) << resolution;
    RecordProperty("voxels" + std::to_string(resolution), std::to_string(found.storedVoxels()));
  }
  for (const std::string& error : context.takeErrors())
    ADD_FAILURE() << error;
}

TEST_P(RealScenes, TakeAtMost24BytesPerVoxelAt512) {
  const TracedScene scene = sceneOf(GetParam());
  for (const int edge : {8, 16}) {
    SceneVoxLink voxlink(scene, {.resolution = 512, .brickEdge = edge}, nullptr, silentProgress());
    const SceneVoxLinkStatistics& statistics = voxlink.statistics();
    const double bytes = double(statistics.bufferBytes) / double(statistics.storedVoxels);
    EXPECT_LE(bytes, 24.0) << edge;
    std::printf("%s 512 [%d]: %llu voxels, %llu fragments, %.1f %% of bricks, %.2f bytes a voxel\n", GetParam(), edge,
                static_cast<unsigned long long>(statistics.storedVoxels),
                static_cast<unsigned long long>(statistics.fragments),
                100.0 * double(statistics.occupiedBricks) / double(statistics.bricks), bytes);
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, RealScenes,
                         testing::Values("bunny.ply.gz", "dragon_vrip_res3.ply.gz", "dragon_vrip_res2.ply.gz",
                                         "glass_house/scene.gltf"));

}  // namespace
}  // namespace freevoxel
