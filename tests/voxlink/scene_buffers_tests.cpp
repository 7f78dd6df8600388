// What fills voxels: the rule against a plain one, buffers against each other, and what must be refused.
#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <glm/glm.hpp>
#include <limits>
#include <random>
#include <set>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/surface_scenes.h"
#include "voxlink/direction_code.h"
#include "voxlink/gl_scene.h"
#include "voxlink/triangle_overlap.h"

namespace freevoxel {
namespace {

using namespace test;
__extension__ using Wide = __int128;
using WideVector = std::array<Wide, 3>;

/// The textbook: projects all corners on all thirteen axes.
bool plainlyTouches(const std::array<glm::ivec3, 3>& triangle, glm::ivec3 voxel) {
  const auto cross = [](WideVector a, WideVector b) {
    return WideVector{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto wide = [](glm::ivec3 v) { return WideVector{v.x, v.y, v.z}; };
  std::vector<WideVector> axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  std::array<WideVector, 3> edges;
  for (size_t i = 0; i < 3; ++i)
    edges[i] = wide(triangle[(i + 1) % 3] - triangle[i]);
  axes.push_back(cross(edges[0], edges[1]));
  for (const WideVector& edge : edges) {
    for (size_t k = 0; k < 3; ++k)
      axes.push_back(cross(edge, axes[k]));
  }
  for (const WideVector& axis : axes) {
    const auto along = [&](WideVector p) { return axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2]; };
    Wide lowT = along(wide(triangle[0])), highT = lowT, lowB = 0, highB = 0;
    for (const glm::ivec3& corner : triangle) {
      lowT = std::min(lowT, along(wide(corner)));
      highT = std::max(highT, along(wide(corner)));
    }
    for (int i = 0; i < 8; ++i) {
      const Wide at = along(wide((voxel + glm::ivec3(i & 1, i >> 1 & 1, i >> 2)) * shared::kSubvoxels));
      lowB = i == 0 ? at : std::min(lowB, at);
      highB = i == 0 ? at : std::max(highB, at);
    }
    if (lowT > highB || highT < lowB) return false;
  }
  return true;
}

std::array<glm::ivec3, 3> randomTriangle(std::mt19937& random, glm::ivec3 size, int grain) {
  std::array<glm::ivec3, 3> triangle;
  for (glm::ivec3& corner : triangle) {
    for (int axis = 0; axis < 3; ++axis)
      corner[axis] = int(random() % uint32_t(size[axis] / grain + 1)) * grain;
  }
  return triangle;
}

// Triangles with corners on subvoxels, and on the borders of voxels, where only the closed rule finds all.
TEST(VoxelRule, IsTheSeparatingAxes) {
  std::mt19937 random(5);
  const glm::ivec3 dims(5, 7, 11);
  uint64_t touched = 0;
  for (const int grain : {1, 37, 128, 256}) {
    for (int n = 0; n < 60; ++n) {
      const std::array<glm::ivec3, 3> corners = randomTriangle(random, dims * shared::kSubvoxels, grain);
      const SnappedTriangle triangle(corners);
      if (triangle.degenerate()) continue;
      std::set<std::array<int, 3>> found;
      triangle.forEachVoxel(dims, [&](glm::ivec3 v) { EXPECT_TRUE(found.insert({v.x, v.y, v.z}).second); });
      for (int z = 0; z < dims.z; ++z) {
        for (int y = 0; y < dims.y; ++y) {
          for (int x = 0; x < dims.x; ++x) {
            const bool expected = plainlyTouches(corners, {x, y, z});
            ASSERT_EQ(triangle.touches({x, y, z}), expected) << grain << " " << n;
            ASSERT_EQ(found.count({x, y, z}) > 0, expected) << grain << " " << n;
            touched += expected ? 1 : 0;
          }
        }
      }
    }
  }
  EXPECT_GT(touched, 5000u);
}

// Corners of the largest grid: 63 bits are enough.
TEST(VoxelRule, HoldsAtTheLargestResolution) {
  std::mt19937 random(6);
  const int most = SceneVoxLinkOptions::kMostResolution;
  for (int n = 0; n < 300; ++n) {
    std::array<glm::ivec3, 3> corners =
        randomTriangle(random, glm::ivec3(most * shared::kSubvoxels), n % 2 ? 1 : 1 << 19);
    const SnappedTriangle triangle(corners);
    if (triangle.degenerate()) continue;
    for (int k = 0; k < 20; ++k) {
      // Near the triangle, so that both answers occur.
      const glm::ivec3 middle = (corners[0] / 3 + corners[1] / 3 + corners[2] / 3) / shared::kSubvoxels;
      const glm::ivec3 voxel = glm::clamp(
          middle + glm::ivec3(int(random() % 5) - 2, int(random() % 5) - 2, int(random() % 5) - 2), 0, most - 1);
      ASSERT_EQ(triangle.touches(voxel), plainlyTouches(corners, voxel));
    }
  }
}

TEST(DirectionCode, IsTheNearestOfAll) {
  std::mt19937 random(7);
  for (int n = 0; n < 2000; ++n) {
    const glm::vec3 v(float(int(random() % 2001) - 1000), float(int(random() % 2001) - 1000),
                      float(int(random() % 2001) - 1000));
    if (v == glm::vec3(0.0f)) continue;
    // Half a step of the angle from z, and half a step about it.
    EXPECT_GT(glm::dot(shared::unpackDirection(shared::packDirection(v.x, v.y, v.z)), glm::normalize(v)), 0.99985f);
  }
  for (const glm::vec3 v : {glm::vec3(0, 0, 1), glm::vec3(0, 0, -1), glm::vec3(1, 0, 0), glm::vec3(0, -1, 0)})
    EXPECT_GT(glm::dot(shared::unpackDirection(shared::packDirection(v.x, v.y, v.z)), v), 0.99998f);
}

struct Built {
  SceneVoxels voxels;
  SceneBuffers buffers;
  uint64_t degenerate = 0;
};
Built build(const TracedScene& scene, int resolution, int edge) {
  Built built;
  built.voxels = sceneVoxels(scene, sceneGrid(sceneBounds(scene), resolution), 0.0);
  built.buffers = buildSceneBuffers(built.voxels, edge, built.degenerate);
  return built;
}

void expectSame(const SceneBuffers& a, const SceneBuffers& b) {
  EXPECT_EQ(a.grid.low, b.grid.low);
  EXPECT_EQ(a.grid.high, b.grid.high);
  ASSERT_EQ(a.brickHeaders, b.brickHeaders);
  ASSERT_EQ(a.voxels, b.voxels);
  ASSERT_EQ(a.brickWords.size(), b.brickWords.size());
  for (size_t i = 0; i < a.brickWords.size(); ++i) {
    ASSERT_EQ(a.brickWords[i].occupied, b.brickWords[i].occupied);
    ASSERT_EQ(a.brickWords[i].rank, b.brickWords[i].rank);
  }
  ASSERT_EQ(a.fragments.size(), b.fragments.size());
  for (size_t i = 0; i < a.fragments.size(); ++i) {
    ASSERT_EQ(a.fragments[i].head, b.fragments[i].head) << i;
    ASSERT_EQ(a.fragments[i].body, b.fragments[i].body) << i;
  }
}

TEST(SceneBuffers, GpuBuildsTheSameBytes) {
  gl::Context context;
  for (const bool normals : {false, true}) {
    const TracedScene scene = mixedScene(true, normals);
    for (const int edge : {4, 8, 16}) {
      const Built cpu = build(scene, 45, edge);
      GlScene gpu(context, uint64_t(1) << 30, 1 << 20);
      uint64_t degenerate = 1;
      gpu.build(cpu.voxels, edge, degenerate, silentProgress());
      EXPECT_EQ(degenerate, cpu.degenerate);
      expectSame(gpu.download(), cpu.buffers);
    }
  }
  for (const std::string& error : context.takeErrors())
    ADD_FAILURE() << error;
}

TEST(SceneBuffers, ThreadsChangeNoByte) {
  const TracedScene scene = mixedScene(true, true);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const Built one = build(scene, 45, 8);
  omp_set_num_threads(5);
  const Built five = build(scene, 45, 8);
  omp_set_num_threads(threads);
  expectSame(one.buffers, five.buffers);
}

// Every voxel that the rule names is there, and no other; sorted along z by the lists themselves.
TEST(SceneBuffers, HoldWhatTheRuleSays) {
  TracedScene scene = mixedScene(false, false);
  scene.spheres = Spheres{};
  const Built built = build(scene, 33, 4);
  const SceneGrid& grid = built.voxels.grid;
  std::set<std::array<int, 3>> expected, found;
  for (const glm::uvec3& t : scene.mesh.triangles) {
    const std::array<glm::ivec3, 3> corners{grid.snapped(scene.mesh.positions[t[0]]),
                                            grid.snapped(scene.mesh.positions[t[1]]),
                                            grid.snapped(scene.mesh.positions[t[2]])};
    const glm::ivec3 low = glm::max(glm::min(corners[0], glm::min(corners[1], corners[2])) / 256 - 1, 0);
    const glm::ivec3 high = glm::min(glm::max(corners[0], glm::max(corners[1], corners[2])) / 256 + 1, grid.dims - 1);
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
          if (plainlyTouches(corners, {x, y, z})) expected.insert({x, y, z});
        }
      }
    }
  }
  forEachStoredVoxel(built.buffers, [&](size_t stored, glm::ivec3 v) {
    EXPECT_LT(built.buffers.voxels[stored], built.buffers.voxels[stored + 1]);
#pragma omp critical(freevoxelTestFound)
    found.insert({v.x, v.y, v.z});
  });
  EXPECT_EQ(found, expected);
}

TEST(SceneBuffers, TrianglesWithoutAreaAreCounted) {
  TracedScene scene;
  const uint32_t material = addMaterial(scene.mesh, glm::vec3(0.5f));
  addQuad(scene.mesh, {0, 0, 0}, {5, 0, 0}, {0, 7, 3}, material);
  addQuad(scene.mesh, {1, 1, 1}, {1e-6f, 0, 0}, {0, 1e-6f, 0}, material);  // a point once snapped
  addQuad(scene.mesh, {1, 1, 1}, {1, 1, 1}, {2, 2, 2}, material);          // lines
  const Built cpu = build(scene, 20, 8);
  EXPECT_EQ(cpu.degenerate, 4u);
  gl::Context context;
  GlScene gpu(context, uint64_t(1) << 28, 1 << 20);
  uint64_t degenerate = 0;
  gpu.build(cpu.voxels, 8, degenerate, silentProgress());
  EXPECT_EQ(degenerate, 4u);
  expectSame(gpu.download(), cpu.buffers);
}

TEST(SceneBuffers, NonsenseIsRefused) {
  const auto expectError = [](const TracedScene& scene, const SceneVoxLinkOptions& options, const char* what) {
    try {
      SceneVoxLink(scene, options, nullptr, silentProgress());
      ADD_FAILURE() << what;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  expectError({}, {}, "expected a mesh with triangles, spheres or a volume");
  const TracedScene good = mixedScene(false, true);
  expectError(good, {.resolution = 0}, "resolution");
  expectError(good, {.resolution = 5000}, "resolution");
  expectError(good, {.brickEdge = 3}, "brick size");
  expectError(good, {.steps = 0}, "steps");
  expectError(good, {.maxDepth = -1}, "reflections");
  TracedScene bad = good;
  bad.mesh.positions[3].y = std::numeric_limits<float>::quiet_NaN();
  expectError(bad, {}, "no number");
  bad = good;
  bad.mesh.triangles[2].z = 1u << 30;
  expectError(bad, {}, "vertex");
  bad = good;
  bad.mesh.materialOfTriangle[1] = 99;
  expectError(bad, {}, "material 99");
  bad = good;
  bad.mesh.materials[0].opacity = 1.5f;
  expectError(bad, {}, "opacity");
  bad = good;
  bad.spheres.radii[0] = 0.0f;
  expectError(bad, {}, "sphere 0");
  bad = good;
  for (glm::vec3& p : bad.mesh.positions)
    p += glm::vec3(1e9f, 0.0f, 0.0f);
  for (glm::vec3& p : bad.spheres.centres)
    p += glm::vec3(1e9f, 0.0f, 0.0f);
  expectError(bad, {}, "finer than its coordinates");
  TracedScene nothing;
  const uint32_t material = addMaterial(nothing.mesh, glm::vec3(0.5f));
  addQuad(nothing.mesh, {1, 1, 1}, {1, 1, 1}, {2, 2, 2}, material);
  expectError(nothing, {}, "nothing of the scene fills a voxel");
}

TEST(SceneBuffers, GpuLimitsAreClear) {
  gl::Context context;
  const TracedScene scene = mixedScene(false, false);
  const auto expectError = [&](const SceneVoxLinkOptions& options, const char* what) {
    try {
      SceneVoxLink gpu(scene, options, &context, silentProgress());
      gpu.light(twoLamps(), Shadows::rays);
      gpu.trace(viewsOf(sceneBounds(scene), 1, {31, 23}).front(), silentProgress());
      ADD_FAILURE() << what;
    } catch (const MachineError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  expectError({.resolution = 45, .gpuMemory = 100000}, "--gpu-memory");
  expectError({.resolution = 45, .rayBuffer = 2000}, "--ray-buffer");
}

// All in one voxel, more than one pass of a shader could walk over.
TEST(SceneBuffers, CrowdedVoxelsAreRefusedOnTheGpuOnly) {
  TracedScene scene;
  scene.spheres.materials.emplace_back();
  for (int i = 0; i < 5000; ++i)
    addSphere(scene.spheres, {float(i % 17) * 0.01f, float(i % 19) * 0.01f, float(i % 23) * 0.01f}, 0.3f, 0);
  EXPECT_EQ(build(scene, 1, 4).buffers.storedVoxels(), 1u);
  gl::Context context;
  EXPECT_THROW(SceneVoxLink(scene, {.resolution = 1}, &context, silentProgress()), MachineError);
}

}  // namespace
}  // namespace freevoxel
