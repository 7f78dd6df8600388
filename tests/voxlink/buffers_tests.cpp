// The VoxLink buffers hold exactly what a plain loop finds, built in C++ and on the GPU.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/voxlink_scenes.h"
#include "voxlink/gl_buffers.h"

namespace freevoxel {
namespace {

using namespace test;

VoxLinkBuffers onGpu(const ValueGrid& grid, const std::vector<uint8_t>& stored, int edge) {
  gl::Context context;
  GlVoxLink voxlink(context, uint64_t(1) << 30);
  voxlink.build(grid, stored, edge, silentProgress());
  VoxLinkBuffers buffers = voxlink.download();
  EXPECT_TRUE(context.takeErrors().empty());
  return buffers;
}

void expectSame(const VoxLinkBuffers& gpu, const VoxLinkBuffers& cpu) {
  EXPECT_EQ(gpu.grid.low, cpu.grid.low);
  EXPECT_EQ(gpu.grid.high, cpu.grid.high);
  EXPECT_EQ(gpu.grid.first, cpu.grid.first);
  EXPECT_EQ(gpu.grid.count, cpu.grid.count);
  EXPECT_EQ(gpu.brickHeaders, cpu.brickHeaders);
  ASSERT_EQ(gpu.brickWords.size(), cpu.brickWords.size());
  for (size_t i = 0; i < gpu.brickWords.size(); ++i) {
    EXPECT_EQ(gpu.brickWords[i].occupied, cpu.brickWords[i].occupied) << i;
    EXPECT_EQ(gpu.brickWords[i].rank, cpu.brickWords[i].rank) << i;
  }
  ASSERT_EQ(gpu.fragments.size(), cpu.fragments.size());
  for (size_t i = 0; i < gpu.fragments.size(); ++i)
    ASSERT_EQ(gpu.fragments[i], cpu.fragments[i]) << i;
}

class Bricks : public ::testing::TestWithParam<int> {};

TEST_P(Bricks, HoldWhatAPlainLoopFinds) {
  for (const VoxLinkScene& scene : {scatteredScene(), floatScene(), ballAboveAFloor()}) {
    const ValueGrid grid = scene.grid();
    for (const double threshold : {0.0, 0.2}) {
      const auto expected = plainLoop(grid, scene.transfer, threshold);
      const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, threshold);
      const VoxLinkBuffers cpu = buildBuffers(grid, stored, GetParam());
      EXPECT_EQ(voxelsIn(cpu), expected);
      expectSame(onGpu(grid, stored, GetParam()), cpu);
      // find() agrees, voxel by voxel.
      size_t found = 0;
      for (int z = -1; z <= grid.dims.z; ++z) {
        for (int y = -1; y <= grid.dims.y; ++y) {
          for (int x = -1; x <= grid.dims.x; ++x)
            found += cpu.find({x, y, z}).has_value();
        }
      }
      EXPECT_EQ(found, expected.size());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfEdge, Bricks, ::testing::Values(4, 8, 16));

TEST(Buffers, FitTheBox) {
  const VoxLinkScene scene = scatteredScene();
  ValueGrid grid = scene.grid();
  std::fill(grid.codes.begin(), grid.codes.end(), uint16_t(0));
  grid.codes[linearIndex({11, 20, 3}, grid.dims)] = 255;
  grid.codes[linearIndex({12, 18, 4}, grid.dims)] = 255;
  const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, 0.0);
  for (const VoxLinkBuffers& buffers : {buildBuffers(grid, stored, 4), onGpu(grid, stored, 4)}) {
    EXPECT_EQ(buffers.grid.low, glm::ivec3(11, 18, 3));
    EXPECT_EQ(buffers.grid.high, glm::ivec3(13, 21, 5));
    EXPECT_EQ(buffers.grid.first, glm::ivec3(2, 4, 0));
    EXPECT_EQ(buffers.grid.count, glm::ivec3(2, 2, 2));
    EXPECT_EQ(buffers.fragments.size(), 2u);
    EXPECT_EQ(buffers.occupiedBricks(), 2u);
  }
}

TEST(Buffers, NormalsAreGradients) {
  const VoxLinkScene scene = floatScene();
  const ValueGrid grid = scene.grid();
  const VoxLinkBuffers buffers = buildBuffers(grid, storedCodes(scene.transfer, grid.coding, 0.0), 8);
  const auto judge = [&](size_t fragment, glm::ivec3 voxel) {
    const glm::vec3 gradient = gradientAt(grid, voxel);
    glm::vec3 normal;
    float surface;
    shared::unpackNormal(shared::fragmentNormal(buffers.fragments[fragment]), normal.x, normal.y, normal.z, surface);
    if (surface < 0.5f) return true;
    return double(glm::dot(normal, glm::normalize(gradient))) > 0.999;
  };
  std::atomic<int> wrong = 0, all = 0;
  forEachStoredVoxel(buffers, [&](size_t fragment, glm::ivec3 voxel) {
    wrong += judge(fragment, voxel) ? 0 : 1;
    ++all;
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(all, 1000);
}

TEST(Buffers, RefuseWhatCannotBe) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, 0.0);
  const std::vector<uint8_t> nothing(stored.size(), uint8_t(0));
  gl::Context context;
  GlVoxLink gpu(context, uint64_t(1) << 30);
  for (const int edge : {-8, 0, 3, 5, 32}) {
    EXPECT_THROW(buildBuffers(grid, stored, edge), InputError) << edge;
    EXPECT_THROW(gpu.build(grid, stored, edge, silentProgress()), InputError) << edge;
  }
  EXPECT_THROW(buildBuffers(grid, nothing, 8), InputError);
  EXPECT_THROW(gpu.build(grid, nothing, 8, silentProgress()), InputError);
  gpu.build(grid, stored, 8, silentProgress());  // still of use
  EXPECT_EQ(gpu.fragments(), plainLoop(grid, scene.transfer, 0.0).size());
}

// Whatever the limit, either all fits or a MachineError says what did not; nothing is allocated beyond it.
TEST(Buffers, GpuMemoryIsBounded) {
  const VoxLinkScene scene = ballAboveAFloor();
  const ValueGrid grid = scene.grid();
  const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, 0.0);
  gl::Context context;
  int refused = 0, built = 0;
  for (uint64_t limit = 16; limit <= uint64_t(1) << 21; limit *= 2) {
    GlVoxLink gpu(context, limit);
    try {
      gpu.build(grid, stored, 8, silentProgress());
      ++built;
    } catch (const MachineError& error) {
      ++refused;
      EXPECT_EQ(built, 0) << "more memory cannot hurt";
      EXPECT_NE(std::string(error.what()).find("--gpu-memory"), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, 3);
  EXPECT_GT(built, 1);
  EXPECT_TRUE(context.takeErrors().empty());
}

// Brick counts beyond one block of the prefix sum, and beyond a block of its blocks' sums.
TEST(Buffers, PrefixSumsOverManyBricks) {
  VoxLinkScene scene = scatteredScene();
  scene.volume.header.dims = {170, 165, 167};  // 43 x 42 x 42 bricks of 4
  scene.volume.data.assign(scene.volume.header.bytes(), std::byte(0));
  uint32_t state = 1;
  for (int i = 0; i < 40000; ++i) {
    state = state * 1664525u + 1013904223u;
    scene.volume.data[state % scene.volume.data.size()] = std::byte(200 + i % 50);
  }
  const ValueGrid grid = scene.grid();
  const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, 0.0);
  const VoxLinkBuffers gpu = onGpu(grid, stored, 4);
  EXPECT_GT(gpu.grid.bricks(), 256u * 256u);
  EXPECT_EQ(voxelsIn(gpu), plainLoop(grid, scene.transfer, 0.0));
  expectSame(gpu, buildBuffers(grid, stored, 4));
}

}  // namespace
}  // namespace freevoxel
