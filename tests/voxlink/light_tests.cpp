// Lamps: what reaches a voxel, by rays and by attenuation, and what it sends to the eye.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <glm/glm.hpp>

#include "base/compare.h"
#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/voxlink_scenes.h"
#include "voxlink/gl_buffers.h"
#include "voxlink/trace_rays.h"
#include "voxlink/voxlink.h"

namespace freevoxel {
namespace {

using namespace test;

struct Built {
  ValueGrid grid;
  VoxLinkBuffers buffers;
  std::vector<VoxelMaterial> materials;

  explicit Built(const VoxLinkScene& scene, int edge = 8) : grid(scene.grid()) {
    const std::vector<uint8_t> stored = storedCodes(scene.transfer, grid.coding, 0.0);
    buffers = buildBuffers(grid, stored, edge);
    materials = voxelMaterials(scene.transfer, grid.coding, stored);
  }
};

/// A homogeneous slab of 6 x 9 x 5 voxels inside 10 x 12 x 11 of unequal spacing.
VoxLinkScene slab(double opacity) {
  VoxLinkScene scene = scatteredScene();
  scene.volume.header.dims = {10, 12, 11};
  scene.volume.data.assign(scene.volume.header.bytes(), std::byte(0));
  for (int z = 3; z < 8; ++z) {
    for (int y = 2; y < 11; ++y) {
      for (int x = 2; x < 8; ++x)
        scene.volume.data[linearIndex({x, y, z}, scene.volume.header.dims)] = std::byte(255);
    }
  }
  scene.transfer.points = {
      {0.0, glm::dvec3(1.0), 0.0}, {254.0, glm::dvec3(1.0), 0.0}, {255.0, glm::dvec3(1.0), opacity}};
  return scene;
}

// Along an axis both are T to the number of voxels in between times their edge.
TEST(Shares, AlongAnAxisAreTheClosedForm) {
  const VoxLinkScene scene = slab(0.3);
  const Built built(scene);
  const glm::dvec3 spacing = scene.volume.header.placement.spacing;
  const double unit = scene.volume.header.placement.unitLength();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Light light{true, glm::dvec3(0.0), glm::vec3(1.0f)};
      light.world[axis] = side * 3.0;
      for (const Shadows shadows : {Shadows::rays, Shadows::attenuation}) {
        const LightShares shares = lightShares(built.buffers, built.materials, {&light, 1}, shadows);
        ASSERT_EQ(shares.size(), size_t(6 * 9 * 5));
        std::atomic<int> wrong = 0;
        forEachStoredVoxel(built.buffers, [&](size_t fragment, glm::ivec3 voxel) {
          const glm::ivec3 low(2, 2, 3), high(7, 10, 7);
          const int between = side > 0.0 ? high[axis] - voxel[axis] : voxel[axis] - low[axis];
          // With `attenuation` a lattice step counts as one edge, and the length per plane restores the rest.
          const double expected = std::pow(0.7, between * spacing[axis] / unit);
          wrong += std::abs(shares[fragment] / 255.0 - expected) > 0.5 / 255.0 + 1e-4;
        });
        EXPECT_EQ(wrong, 0) << axis << " " << side << " " << int(shadows);
      }
    }
  }
}

TEST(Shares, AttenuationIsNearRays) {
  const Built built(slab(0.1));
  const std::vector<Light> lights = {{true, {0.3, 1.0, -0.2}, glm::vec3(1.0f)},
                                     {false, {20.0, -9.0, 30.0}, glm::vec3(1.0f)}};
  const LightShares rays = rayShares(built.buffers, built.materials, lights);
  const LightShares attenuation = attenuationShares(built.buffers, built.materials, lights);
  double sum = 0.0;
  for (size_t i = 0; i < rays.size(); ++i)
    sum += std::abs(double(rays[i]) - attenuation[i]) / 255.0;
  EXPECT_LT(sum / double(rays.size()), 0.05);
  EXPECT_GT(*std::max_element(rays.begin(), rays.end()), 200);
  EXPECT_LT(*std::min_element(rays.begin(), rays.end()), 150);
}

TEST(Shares, LampInsideAVoxelReachesItWhole) {
  const VoxLinkScene scene = slab(0.5);
  const Built built(scene);
  const Placement& placement = scene.volume.header.placement;
  const glm::ivec3 home(4, 5, 6);
  const Light light{false, glm::dvec3(placement.worldFromIndex() * glm::dvec4(glm::dvec3(home), 1.0)), glm::vec3(1.0f)};
  for (const Shadows shadows : {Shadows::rays, Shadows::attenuation}) {
    const LightShares shares = lightShares(built.buffers, built.materials, {&light, 1}, shadows);
    forEachStoredVoxel(built.buffers, [&](size_t fragment, glm::ivec3 voxel) {
      if (voxel == home) {
        EXPECT_EQ(shares[fragment], 255);
      }
    });
  }
}

TEST(Shares, RaysOnTheGpuAreThoseOfTheCpu) {
  gl::Context context;
  for (const VoxLinkScene& scene : {scatteredScene(), ballAboveAFloor()}) {
    for (const int edge : {4, 8, 16}) {
      const Built built(scene, edge);
      const std::vector<Light> lights = {{true, {0.3, 1.0, -0.2}, glm::vec3(1.0f)},
                                         {false, {20.0, 39.0, 30.0}, glm::vec3(1.0f)}};
      GlVoxLink gpu(context, uint64_t(1) << 30);
      gpu.build(built.grid, storedCodes(scene.transfer, built.grid.coding, 0.0), edge, silentProgress());
      gpu.setMaterials(built.materials);
      gpu.traceShares(lights);
      const LightShares found = gpu.downloadShares(), expected = rayShares(built.buffers, built.materials, lights);
      ASSERT_EQ(found.size(), expected.size());
      size_t different = 0;
      for (size_t i = 0; i < found.size(); ++i)
        different += std::abs(int(found[i]) - int(expected[i])) > 1;
      // Rays that graze edges, as in Trace.GpuAgreesWithCpu.
      EXPECT_LE(different, 2 + found.size() / 200) << edge;
    }
  }
  EXPECT_TRUE(context.takeErrors().empty());
}

/// Mean light of the floor's pixels round a world point, seen from straight above.
double floorLight(const Image& picture, const Camera& camera, double x, double z) {
  const auto projected = project(viewFrame(camera), {x, 2.5, z});
  const glm::ivec2 pixel(projected->pixel);
  double sum = 0.0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx)
      sum += double(picture.at(pixel.x + dx, pixel.y + dy)[0]) / 9.0;
  }
  return sum;
}

TEST(Lamps, ShadowsFallAwayFromThem) {
  const VoxLinkScene scene = ballAboveAFloor();
  const ValueGrid grid = scene.grid();
  Camera camera;
  camera.eye = {20.0, 200.0, 18.0};
  camera.target = {20.0, 0.0, 18.0};
  camera.up = {0.0, 0.0, -1.0};
  camera.orthographicHeight = 40.0;
  camera.imageSize = {160, 150};
  gl::Context context;
  for (const gl::Context* backend :
       {static_cast<const gl::Context*>(nullptr), static_cast<const gl::Context*>(&context)}) {
    VoxLink voxlink(grid, scene.transfer, {}, backend, silentProgress());
    for (const Shadows shadows : {Shadows::rays, Shadows::attenuation, Shadows::none}) {
      for (const double side : {1.0, -1.0}) {
        Lighting lighting;
        lighting.ambient = 0.1f;
        lighting.lights = {{true, {side, 1.0, 0.0}, glm::vec3(1.0f)}};
        voxlink.light(lighting, shadows);
        const Image picture = voxlink.trace(camera, silentProgress());
        const double shadow = floorLight(picture, camera, 20.0 - side * 12.5, 18.0);
        if (shadows == Shadows::none) {
          EXPECT_GT(shadow, 1.0);
        } else {
          EXPECT_LT(shadow, 0.2) << int(shadows) << " " << side;
        }
        EXPECT_GT(floorLight(picture, camera, 20.0 + side * 12.5, 18.0), 0.9) << int(shadows) << " " << side;
      }
    }
  }
}

TEST(Lamps, PicturesOfBothBackendsAgree) {
  const VoxLinkScene scene = ballAboveAFloor();
  const ValueGrid grid = scene.grid();
  gl::Context context;
  VoxLink cpu(grid, scene.transfer, {}, nullptr, silentProgress());
  VoxLink gpu(grid, scene.transfer, {}, &context, silentProgress());
  Lighting lighting;
  lighting.ambient = 0.1f;
  lighting.lights = {{true, {1.0, 1.0, 0.3}, {1.0f, 0.3f, 0.2f}}, {false, {10.0, 25.0, 30.0}, {0.1f, 0.2f, 2.0f}}};
  for (const Shading shading : {Shading::none, Shading::lambert, Shading::phong}) {
    lighting.shading = shading;
    for (const Shadows shadows : {Shadows::rays, Shadows::attenuation, Shadows::none}) {
      cpu.light(lighting, shadows);
      gpu.light(lighting, shadows);
      for (const Camera& camera : viewsOf(scene.bounds(), 3, {70, 60})) {
        const ImageDifference difference =
            compareImages(cpu.trace(camera, silentProgress()), gpu.trace(camera, silentProgress()));
        // Light has 9 bits a channel, and normals may be one step apart.
        EXPECT_GE(difference.psnr, 45.0) << int(shading) << " " << int(shadows);
      }
    }
  }
  EXPECT_TRUE(context.takeErrors().empty());
}

TEST(Lamps, WithoutShadowOrShadingChangeNothing) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  const Camera camera = viewsOf(scene.bounds(), 1, {61, 43}).front();
  VoxLink voxlink(grid, scene.transfer, {}, nullptr, silentProgress());
  const Image unlit = voxlink.trace(camera, silentProgress());
  Lighting lighting;
  lighting.ambient = 0.0f;
  lighting.lights = {{true, {1.0, 0.0, 0.0}, glm::vec3(1.0f)}};
  voxlink.light(lighting, Shadows::none);
  const Image lit = voxlink.trace(camera, silentProgress());
  for (size_t i = 0; i < lit.pixels.size(); ++i)
    ASSERT_NEAR(lit.pixels[i], unlit.pixels[i], 2e-3);
}

TEST(Lamps, RefuseNonsense) {
  const VoxLinkScene scene = scatteredScene();
  const ValueGrid grid = scene.grid();
  VoxLink voxlink(grid, scene.transfer, {}, nullptr, silentProgress());
  Lighting lighting;
  lighting.lights = {{true, {0, 0, 0}, glm::vec3(1.0f)}};
  EXPECT_THROW(voxlink.light(lighting, Shadows::rays), InputError);
  lighting.lights = {{true, {1, 0, 0}, glm::vec3(NAN)}};
  EXPECT_THROW(voxlink.light(lighting, Shadows::rays), InputError);
  lighting.lights.clear();
  lighting.ambient = -1.0f;
  EXPECT_THROW(voxlink.light(lighting, Shadows::rays), InputError);
}

}  // namespace
}  // namespace freevoxel
