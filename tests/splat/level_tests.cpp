// Cuts through the hierarchy: no seams, the same bits whatever is in memory, and what is left out adds nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <glm/glm.hpp>

#include "base/compare.h"
#include "base/error.h"
#include "splat/cell_block.h"
#include "splat/level_selection.h"
#include "splat/pixel_rays.h"
#include "tests/splat/scene.h"

namespace freevoxel {
namespace {

using namespace test;

bool sameSums(const SplatResult& a, const SplatResult& b) {
  return a.sums.quantum == b.sums.quantum && a.sums.image.size == b.sums.image.size &&
         std::memcmp(a.sums.image.pixels.data(), b.sums.image.pixels.data(),
                     a.sums.image.pixels.size() * sizeof(float)) == 0;
}

/// Longer than it is wide, so that a near end and a far one differ in level.
Scene uniformBox() {
  return makeScene(makeVolume({41, 37, 150}, {1.0, 1.2, 0.9}, [](int, int, int) { return 200; }),
                   uniformOpacity(0.02, {0.9, 0.5, 0.2}), 8, Classification::preintegrated);
}

Scene lumps() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                     {120.0, glm::dvec3(0.2, 0.9, 0.3), 0.0},
                     {140.0, glm::dvec3(0.2, 0.9, 0.3), 0.05},
                     {255.0, glm::dvec3(1.0, 0.4, 0.1), 0.6}};
  return makeScene(makeVolume({45, 37, 100}, {1.0, 0.7, 1.1},
                              [](int x, int y, int z) {
                                return int(127.5 + 60.0 * std::sin(0.3 * x) + 40.0 * std::cos(0.4 * y + 0.2 * z) +
                                           27.0 * std::sin(0.5 * z - 0.1 * x));
                              }),
                   transfer, 8, Classification::preintegrated);
}

/// Along the box's long side, from close by.
Camera alongView(const Scene& scene, glm::ivec2 imageSize) {
  const Box box = scene.bounds();
  Camera camera;
  camera.target = 0.5 * (box.lower + box.upper);
  camera.eye = {camera.target.x + 18.0, camera.target.y + 14.0, box.upper.z + 22.0};
  camera.verticalFov = 0.9;
  camera.imageSize = imageSize;
  return camera;
}

int levelsDrawn(const SplatStatistics& statistics) {
  int count = 0;
  for (const uint64_t blocks : statistics.blocksOfLevel)
    count += blocks > 0 ? 1 : 0;
  return count;
}

TEST(Levels, MixedCutOfAUniformBoxIsBeerLambert) {
  const Scene scene = uniformBox();
  const Camera camera = alongView(scene, {83, 61});
  SplatOptions options;
  options.lodPixels = 2.5;
  const SplatResult result = splatScene(scene, camera, options);
  ASSERT_GE(levelsDrawn(result.statistics), 2);
  const Image picture = resolve(result.sums, Formula::normalised);
  const std::vector<PixelRay> rays = pixelRays(scene.volume.header.placement, scene.volume.header.dims, camera);
  const glm::vec3 colour = scene.transfer.at(200.0).linear;
  const double extinction = scene.transfer.extinctionAt(200.0);
  int covered = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    const double length = std::max(0.0f, rays[i].sHigh - rays[i].sLow) * double(rays[i].lengthPerPlane);
    const double alpha = 1.0 - std::exp(-extinction * length);
    covered += alpha > 0.01 ? 1 : 0;
    ASSERT_NEAR(picture.pixels[i * 4 + 3], alpha, 1.0 / 255.0) << i;
    ASSERT_NEAR(picture.pixels[i * 4], colour.r * alpha, 1.0 / 255.0) << i;
  }
  EXPECT_GT(covered, 1000);
}

TEST(Levels, CutTilesTheVolumeAndIsFinerNearTheEye) {
  const Scene scene = uniformBox();
  const Camera camera = alongView(scene, {83, 61});
  Splatter splatter(*scene.file, scene.transfer, Backend::cpu, 16);
  SplatOptions options;
  options.lodPixels = 2.5;
  splatter.prepare(camera, options);
  const glm::ivec3 dims = scene.volume.header.dims;
  std::vector<int> owners(voxelCount(dims), 0);
  const VolumeView view = volumeView(scene.volume.header.placement, camera);
  for (const VisibleBlock& block : splatter.blocks()) {
    const int voxels = 1 << block.level;
    const glm::ivec3 first = block.origin * voxels, last = glm::min(first + 16 * voxels, dims);
    for (int z = first.z; z < last.z; ++z) {
      for (int y = first.y; y < last.y; ++y) {
        for (int x = first.x; x < last.x; ++x)
          ++owners[linearIndex({x, y, z}, dims)];
      }
    }
    const bool shown = !pixelBounds(view, block).empty();
    if (shown && block.level > 0) {
      EXPECT_LE(largestVoxel(block, 16, view), 2.5);
    }
  }
  EXPECT_EQ(std::count(owners.begin(), owners.end(), 1), int64_t(owners.size()));
}

// Coarse sums are taken back exactly: what is left at the end are the bits of the direct picture. Blocks of 16, since
// there are to be many.
TEST(Levels, RefinementEndsInTheBitsOfTheDirectPicture) {
  // Its waves are longer than voxels of the coarsest level, of which finer levels could not be sure to be nearer.
  const Scene scene =
      makeScene(makeVolume({45, 37, 100}, {1.0, 0.7, 1.1},
                           [](int x, int y, int z) {
                             return int(127.5 + 90.0 * std::sin(0.11 * x + 0.05 * z) * std::cos(0.1 * y) +
                                        37.0 * std::cos(0.09 * z));
                           }),
                lumps().transfer, 8, Classification::preintegrated);
  const Camera camera = randomViews(scene.bounds(), 1, {83, 61})[0];
  SplatOptions cell, kernel = kKernel, interpolated, coarse, lit;
  interpolated.attenuation = AttenuationSource::interpolated;
  coarse.lodPixels = 1.2;
  lit.lighting.lights = {{true, {0.3, 1.0, 0.2}, {1.0f, 0.8f, 0.5f}}};
  lit.lighting.ambient = 0.2f;
  for (const SplatOptions& options : {cell, kernel, interpolated, coarse, lit}) {
    Splatter splatter(*scene.file, scene.transfer, Backend::cpu, 16);
    std::vector<Image> pictures;
    const SplatResult refined = splatter.refine(
        camera, options,
        [&](size_t n, const Sums& sums) {
          ASSERT_EQ(n, pictures.size());
          pictures.push_back(resolve(sums, Formula::normalised));
        },
        silentProgress());
    ASSERT_GE(pictures.size(), options.lodPixels > 0.0 ? 2u : 9u);
    EXPECT_TRUE(sameSums(refined, splatter.render(camera, options, silentProgress())));
    double before = 0.0;
    for (size_t n = 0; n + 1 < pictures.size(); ++n) {
      const double now = compareImages(pictures[n], pictures.back()).psnr;
      EXPECT_GE(now, before - 0.05) << n;
      before = now;
    }
    EXPECT_GT(before, compareImages(pictures[0], pictures.back()).psnr + 1.0);
    if (options.lighting.unlit()) continue;
    SplatOptions bounded = options;
    bounded.memoryBytes = uint64_t(48) << 20;
    splatter.refine(
        camera, bounded,
        [&](size_t n, const Sums& sums) {
          ASSERT_LT(n, pictures.size());
          EXPECT_TRUE(compareImages(pictures[n], resolve(sums, Formula::normalised)).identical) << n;
        },
        silentProgress());
  }
}

TEST(Levels, RefinementNeedsLevelsAndWhatIsKnownOfThem) {
  const Scene scene = lumps();
  const auto refuse = [](size_t, const Sums&) { FAIL(); };
  const ValueGrid grid = scene.grid();
  const Camera camera = alongView(scene, {8, 8});
  Splatter withoutFile(grid, nullptr, scene.transfer, Backend::cpu, 16);
  EXPECT_THROW(withoutFile.refine(camera, {}, refuse, silentProgress()), InputError);
  Splatter splatter(*scene.file, scene.transfer, Backend::cpu, 16);
  SplatOptions swept;
  swept.attenuation = AttenuationSource::swept;
  EXPECT_THROW(splatter.refine(camera, swept, refuse, silentProgress()), InputError);
}

// Kernels keep their mass whatever their level.
TEST(Levels, KernelsOfAMixedCutHaveTheDepthOfTheFinest) {
  const Scene scene = uniformBox();
  const Camera camera = alongView(scene, {83, 61});
  SplatOptions options = kKernel;
  const Image finest = resolve(splatScene(scene, camera, options).sums, Formula::normalised);
  options.lodPixels = 2.5;
  const SplatResult result = splatScene(scene, camera, options);
  ASSERT_GE(levelsDrawn(result.statistics), 2);
  // Wider kernels swell the box's outline; where they meet others of another size, their weights ripple by a few per
  // cent of the extinction of a voxel.
  EXPECT_GE(compareImages(resolve(result.sums, Formula::normalised), finest).psnr, 24.0);
}

TEST(Levels, SameBitsWhateverTheOrderBackendAndMemory) {
  const Scene scene = lumps();
  const Camera camera = alongView(scene, {64, 47});
  for (const Footprint footprint : {Footprint::cell, Footprint::kernel}) {
    for (const double lod : {0.0, 2.5}) {
      SplatOptions options;
      options.footprint = footprint;
      options.lodPixels = lod;
      options.lighting.ambient = 0.2f;
      options.lighting.shading = Shading::phong;
      options.lighting.lights = {{true, {1.0, 2.0, 1.0}, {1.0f, 0.8f, 0.5f}}};
      const SplatResult first = splatScene(scene, camera, options);
      EXPECT_EQ(levelsDrawn(first.statistics), lod > 0.0 ? levelsDrawn(first.statistics) : 1);
      if (lod > 0.0) {
        EXPECT_GE(levelsDrawn(first.statistics), 2);
      }
      for (const Backend backend : {Backend::cpu, Backend::gl}) {
        Splatter fromFile(*scene.file, scene.transfer, backend);
        options.order = {SplatOrder::Kind::shuffle, 3};
        options.memoryBytes = 0;
        options.gpuMemoryBytes = 0;
        EXPECT_TRUE(sameSums(fromFile.render(camera, options, silentProgress()), first));
        options.memoryBytes = uint64_t(24) << 20;
        options.gpuMemoryBytes = uint64_t(8) << 20;
        const SplatResult bounded = fromFile.render(camera, options, silentProgress());
        EXPECT_TRUE(sameSums(bounded, first)) << int(backend);
        EXPECT_LE(bounded.statistics.glBytes, options.gpuMemoryBytes);
        if (backend == Backend::gl) {
          EXPECT_GT(bounded.statistics.glBytes, 0u);
        }
      }
    }
  }
}

// Near fields are traced brick by brick then, and not in arrays of the whole volume.
TEST(Levels, CutOfTheFinestLevelHasTheBitsOfTheDirectPicture) {
  const Scene scene = lumps();
  const Camera camera = alongView(scene, {41, 30});
  SplatOptions shaded;
  shaded.lighting.lights = {{true, {1.0, 2.0, 1.0}, {1.0f, 0.8f, 0.5f}},
                            {false, {90.0, -40.0, 20.0}, {0.2f, 0.5f, 1.0f}}};
  shaded.lighting.ambient = 0.2f;
  shaded.lighting.shading = Shading::phong;
  for (SplatOptions options : {SplatOptions{}, shaded}) {
    Splatter splatter(*scene.file, scene.transfer, Backend::cpu, 16);
    const SplatResult direct = splatter.render(camera, options, silentProgress());
    ASSERT_EQ(direct.statistics.attenuation, "stored");
    options.lodPixels = 1e-3;
    const SplatResult cut = splatter.render(camera, options, silentProgress());
    EXPECT_TRUE(sameSums(cut, direct));
    EXPECT_EQ(levelsDrawn(cut.statistics), 1);
    options.lodPixels = 0.0;
    options.blockwise = true;
    EXPECT_TRUE(sameSums(splatter.render(camera, options, silentProgress()), direct));
    options.memoryBytes = uint64_t(24) << 20;
    EXPECT_TRUE(sameSums(splatter.render(camera, options, silentProgress()), direct));
  }
}

// A splatter keeps bricks and its canvas from frame to frame.
TEST(Levels, FramesDoNotDependOnThoseBefore) {
  const Scene scene = lumps();
  SplatOptions coarse, kernel = kKernel, shaded, finest, swept, bounded, nearLit;
  coarse.lodPixels = kernel.lodPixels = shaded.lodPixels = bounded.lodPixels = 2.5;
  shaded.lighting.ambient = 0.2f;
  shaded.lighting.shading = Shading::phong;
  shaded.lighting.lights = {{true, {1.0, 2.0, 1.0}, {1.0f, 0.8f, 0.5f}}};
  for (SplatOptions* options : {&kernel, &shaded, &finest})
    options->attenuation = options->lightAttenuation = AttenuationSource::interpolated;
  nearLit.lodPixels = 1e-3;
  nearLit.lighting = shaded.lighting;
  swept.attenuation = AttenuationSource::swept;
  bounded.memoryBytes = uint64_t(24) << 20;
  bounded.gpuMemoryBytes = uint64_t(8) << 20;
  const std::vector<SplatOptions> row = {coarse, shaded,  kernel, coarse, bounded,
                                         swept,  nearLit, shaded, finest, coarse};
  const auto view = [&](size_t n) {
    Camera camera = alongView(scene, n % 3 == 2 ? glm::ivec2(31, 40) : glm::ivec2(41, 30));
    camera.eye.x += 3.0 * double(n % 4);
    return camera;
  };
  Splatter cpu(*scene.file, scene.transfer, Backend::cpu), gl(*scene.file, scene.transfer, Backend::gl);
  std::vector<SplatResult> alone;
  for (size_t n = 0; n < row.size(); ++n) {
    alone.push_back(splatScene(scene, view(n), row[n]));
    EXPECT_TRUE(sameSums(cpu.render(view(n), row[n], silentProgress()), alone[n])) << n;
    if (n < 5) {
      EXPECT_TRUE(sameSums(gl.render(view(n), row[n], silentProgress()), alone[n])) << n;
    }
  }
  EXPECT_FALSE(sameSums(alone[0], alone[3]));
}

TEST(Levels, TooLittleMemoryIsAnError) {
  const Scene scene = lumps();
  const Camera camera = alongView(scene, {64, 47});
  SplatOptions options;
  const SplatResult expected = splatScene(scene, camera, options);
  options.memoryBytes = 1000;
  Splatter cpu(*scene.file, scene.transfer, Backend::cpu);
  EXPECT_THROW(cpu.render(camera, options, silentProgress()), MachineError);
  options.memoryBytes = 0;
  options.gpuMemoryBytes = uint64_t(1) << 19;
  Splatter gl(*scene.file, scene.transfer, Backend::gl);
  EXPECT_THROW(gl.render(camera, options, silentProgress()), MachineError);
  // What a frame left undone is not in the way of the next.
  options.gpuMemoryBytes = 0;
  EXPECT_TRUE(sameSums(cpu.render(camera, options, silentProgress()), expected));
  EXPECT_TRUE(sameSums(gl.render(camera, options, silentProgress()), expected));
}

TEST(Levels, SweptAttenuationAndOtherColoursAreRefused) {
  const Scene scene = lumps();
  const Camera camera = alongView(scene, {64, 47});
  SplatOptions options;
  options.lodPixels = 1.0;
  options.attenuation = AttenuationSource::swept;
  EXPECT_THROW(splatScene(scene, camera, options), InputError);
  options.attenuation = AttenuationSource::interpolated;
  TransferFunction recoloured = scene.transfer;
  recoloured.points[1].srgb = {0.3, 0.3, 0.4};
  Splatter splatter(*scene.file, recoloured, Backend::cpu);
  EXPECT_THROW(splatter.render(camera, options, silentProgress()), InputError);
}

TEST(Cull, WhatAddsNothingIsLeftOutWithoutChangingABit) {
  const Scene scene = lumps();
  // So close that much of the volume is off the image.
  Camera camera = alongView(scene, {40, 31});
  camera.verticalFov = 0.15;
  for (const double lod : {0.0, 2.5}) {
    SplatOptions options;
    options.lodPixels = lod;
    const SplatResult culled = splatScene(scene, camera, options);
    options.cull = Cull::off;
    const SplatResult all = splatScene(scene, camera, options);
    EXPECT_TRUE(sameSums(culled, all));
    EXPECT_GT(culled.statistics.culledBlocks + culled.statistics.emptyBlocks, 0u);
    EXPECT_GT(all.statistics.blocks, culled.statistics.blocks);
  }
}

}  // namespace
}  // namespace freevoxel
