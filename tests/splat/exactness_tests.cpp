// The same bits for any order, thread count and backend (DESIGN section 4).
#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <cstring>
#include <glm/glm.hpp>

#include "base/compare.h"
#include "base/error.h"
#include "tests/splat/scene.h"

namespace freevoxel {
namespace {

using namespace test;

bool sameBits(const Image& a, const Image& b) {
  return a.size == b.size && a.channels == b.channels &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)) == 0;
}

struct ThreadCount {
  explicit ThreadCount(int count) : before(omp_get_max_threads()) { omp_set_num_threads(count); }
  ~ThreadCount() { omp_set_num_threads(before); }
  int before;
};

const std::vector<SplatOrder>& orders() {
  using Kind = SplatOrder::Kind;
  static const std::vector<SplatOrder> all = {
      {Kind::hilbert, 0}, {Kind::reverse, 0}, {Kind::shuffle, 1}, {Kind::shuffle, 2}};
  return all;
}

/// Draws in every order, with 1 to 3 threads and on both backends; all must equal the first. Gives that back. On the
/// CPU each starts anew, attenuation included; a context of OpenGL and its shaders take long to make and serve all
/// orders.
SplatResult expectOneResult(const Scene& scene, const Camera& camera, Formula formula,
                            Footprint footprint = Footprint::kernel,
                            AttenuationSource attenuation = AttenuationSource::automatic, Cull cull = Cull::none) {
  SplatOptions options;
  options.cull = cull;
  options.formula = formula;
  options.footprint = footprint;
  options.attenuation = attenuation;
  SplatResult first = splatScene(scene, camera, options);
  EXPECT_GT(first.statistics.splats, 0u);
  const ValueGrid grid = valueGrid(*scene.file);
  Splatter onGl(grid, scene.file.get(), scene.transfer, Backend::gl);
  for (const Backend backend : {Backend::cpu, Backend::gl}) {
    for (const SplatOrder& order : orders()) {
      options.order = order;
      const ThreadCount threads(1 + int(&order - orders().data()) % 3);
      const SplatResult result = backend == Backend::gl ? onGl.render(camera, options, silentProgress())
                                                        : splatScene(scene, camera, options, backend);
      EXPECT_TRUE(sameBits(result.sums.image, first.sums.image))
          << result.statistics.backend << ", order " << int(order.kind) << ":" << order.seed;
      EXPECT_EQ(result.sums.quantum, first.sums.quantum);
      EXPECT_EQ(result.statistics.splats, first.statistics.splats);
      EXPECT_TRUE(sameBits(resolve(result.sums, formula), resolve(first.sums, formula)));
    }
  }
  return first;
}

/// Mist before and behind an opaque wall across y that ends before the border: where the border cuts opaque matter,
/// pixels at its edges may lose depth (docs/fidelity.md).
Scene wallInMist() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.2, 0.4, 1.0), 0.02},
                     {100.0, glm::dvec3(0.3, 1.0, 0.4), 0.05},
                     {200.0, glm::dvec3(1.0, 0.5, 0.2), 0.9},
                     {255.0, glm::dvec3(1.0, 0.5, 0.2), 0.99}};
  return makeScene(makeVolume({49, 41, 37}, {1.0, 0.9, 1.2},
                              [](int x, int y, int z) {
                                const bool wall = y >= 18 && y < 24 && x >= 5 && x < 44 && z >= 5 && z < 32;
                                return wall ? 255 : (x * 3 + y * 5 + z * 7) % 100;
                              }),
                   transfer, 16, Classification::preintegrated);
}

TEST(Exactness, EverySourceOfAttenuationAndHiddenCells) {
  const Scene scene = wallInMist();
  const Camera camera = randomViews(scene.bounds(), 1, {47, 35}).front();
  for (const AttenuationSource source : {AttenuationSource::interpolated, AttenuationSource::stored,
                                         AttenuationSource::quotient, AttenuationSource::swept}) {
    expectOneResult(scene, camera, Formula::normalised, Footprint::cell, source, Cull::hidden);
    expectOneResult(scene, camera, Formula::normalised, Footprint::kernel, source, Cull::hidden);
  }
}

// Beyond an opaque wall nothing needs to be drawn, and the picture hardly shows it.
// Rays slip through gaps that the voxels round them know nothing of. Where one ends behind them the pixel gets no less
// opaque than it is, and, as full of holes as this is, hardly more.
TEST(Cull, HiddenCellsBehindGapsStayOpaque) {
  const Scene scene = makeScene(makeVolume({41, 37, 33}, {1.0, 0.8, 1.1},
                                           [](int x, int y, int z) {
                                             const uint32_t mixed = uint32_t(x * 73 + y * 179 + z * 283) * 2654435761u;
                                             return mixed >> 29 < 3u ? 0 : 255;
                                           }),
                                wallInMist().transfer, 8, Classification::preintegrated);
  uint64_t pieces = 0, allPieces = 0;
  for (const Camera& camera : randomViews(scene.bounds(), 6, {83, 61})) {
    SplatOptions options;
    options.attenuation = AttenuationSource::swept;
    const SplatResult all = splatScene(scene, camera, options);
    options.cull = Cull::hidden;
    const SplatResult culled = splatScene(scene, camera, options);
    const Image expected = resolve(all.sums, Formula::normalised), picture = resolve(culled.sums, Formula::normalised);
    for (size_t i = 3; i < picture.pixels.size(); i += 4) {
      ASSERT_GE(picture.pixels[i], expected.pixels[i] - 0x1p-10) << i / 4;  // four times what a ray may end at
      ASSERT_LE(picture.pixels[i], expected.pixels[i] + 0.05f) << i / 4;
    }
    pieces += culled.statistics.pieces;
    allPieces += all.statistics.pieces;
  }
  EXPECT_LT(double(pieces), 0.9 * double(allPieces));
}

TEST(Cull, HiddenCellsAreNotMissed) {
  const Scene scene = wallInMist();
  for (const Camera& camera : randomViews(scene.bounds(), 6, {83, 61})) {
    for (const AttenuationSource source :
         {AttenuationSource::interpolated, AttenuationSource::stored, AttenuationSource::swept}) {
      SplatOptions options;
      options.attenuation = source;
      const SplatResult all = splatScene(scene, camera, options);
      options.cull = Cull::hidden;
      const SplatResult culled = splatScene(scene, camera, options);
      const double psnr =
          compareImages(resolve(culled.sums, Formula::normalised), resolve(all.sums, Formula::normalised)).psnr;
      // The bounds: rays end only with swept attenuation.
      EXPECT_GE(psnr, source == AttenuationSource::swept ? 80.0 : 60.0) << attenuationSourceName(source);
      EXPECT_LE(culled.statistics.pieces, all.statistics.pieces);
      if (source == AttenuationSource::swept) {
        EXPECT_LT(double(culled.statistics.pieces), 0.9 * double(all.statistics.pieces));
      }
    }
  }
}

TEST(Exactness, AwkwardVolumeInPerspective) {
  const Scene scene = awkwardScene();
  for (const Camera& camera : randomViews(scene.bounds(), 2, {97, 64})) {
    for (const Formula formula : {Formula::normalised, Formula::paper})
      expectOneResult(scene, camera, formula);
  }
}

TEST(Exactness, AwkwardVolumeOrthographic) {
  const Scene scene = awkwardScene();
  expectOneResult(scene, orbitCamera(scene.bounds(), {0.7, 0.4, std::nullopt}, {64, 97}, 0.5, 0.0), Formula::direct);
}

/// Larger than a block along two axes, smaller than one along the third.
Scene blockyScene() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                     {120.0, glm::dvec3(0.2, 0.9, 0.3), 0.0},
                     {140.0, glm::dvec3(0.2, 0.9, 0.3), 0.05},
                     {255.0, glm::dvec3(1.0, 0.4, 0.1), 0.6}};
  return makeScene(makeVolume({45, 37, 20}, {1.0, 0.7, 1.9},
                              [](int x, int y, int z) {
                                return int(127.5 + 60.0 * std::sin(0.3 * x) + 40.0 * std::cos(0.4 * y + 0.2 * z) +
                                           27.0 * std::sin(0.5 * z - 0.1 * x));
                              }),
                   transfer, 8);
}

TEST(Exactness, CellsInPerspective) {
  for (const AttenuationSource source : {AttenuationSource::interpolated, AttenuationSource::swept}) {
    const Scene scene = blockyScene();
    for (const Camera& camera : randomViews(scene.bounds(), 2, {97, 64})) {
      expectOneResult(scene, camera, Formula::normalised, Footprint::cell, source);
    }
    const Scene awkward = awkwardScene();
    expectOneResult(awkward, randomViews(awkward.bounds(), 1, {64, 97}).front(), Formula::direct, Footprint::cell,
                    source);
  }
}

// More blocks than pass through the buffers at a time: what a batch draws must not be overwritten by the next.
TEST(Exactness, CellsOfManyBatches) {
  const Scene scene = makeScene(
      makeVolume({150, 140, 110}, glm::dvec3(1.0), [](int x, int y, int z) { return (x * 5 + y * 3 + z * 7) % 256; }),
      whiteRamp(0.02), 16, Classification::preintegrated);
  const Camera camera = randomViews(scene.bounds(), 1, {60, 50}).front();
  const SplatResult cpu = splatScene(scene, camera, {}, Backend::cpu);
  const SplatResult gl = splatScene(scene, camera, {}, Backend::gl);
  EXPECT_GT(cpu.statistics.blocks, 90u);
  EXPECT_TRUE(sameBits(cpu.sums.image, gl.sums.image));
}

TEST(Exactness, CellsOrthographic) {
  const Scene scene = blockyScene();
  for (const double azimuth : {0.0, 0.7, 3.0}) {
    expectOneResult(scene, orbitCamera(scene.bounds(), {azimuth, 0.4, std::nullopt}, {64, 97}, 0.5, 0.0),
                    Formula::normalised, Footprint::cell);
  }
}

TEST(Exactness, CellsWithTheEyeInside) {
  const Scene scene = blockyScene();
  Camera camera;
  camera.eye = scene.bounds().centre() + glm::dvec3(0.2, 0.1, 0.3);
  camera.target = camera.eye + glm::dvec3(0.3, 0.2, -1.0);
  camera.verticalFov = 1.5;
  camera.imageSize = {123, 77};
  const SplatResult result = expectOneResult(scene, camera, Formula::normalised, Footprint::cell);
  EXPECT_EQ(result.statistics.attenuation, "swept");
  for (const float value : resolve(result.sums, Formula::normalised).pixels)
    EXPECT_TRUE(std::isfinite(value));
}

TEST(Exactness, SplatsSmallerThanAPixel) {
  const Scene scene = awkwardScene();
  expectOneResult(scene, orbitCamera(scene.bounds(), {0.7, 0.4, 4000.0}, {31, 22}, 0.5, std::nullopt),
                  Formula::normalised);
}

// 64 times magnified: splats larger than any driver's points, centres off screen, some behind the near plane.
TEST(Exactness, MagnifiedViewBeyondThePointLimit) {
  const Scene scene = awkwardScene();
  Camera camera = orbitCamera(scene.bounds(), {0.3, 0.2, std::nullopt}, {400, 300}, 0.5, std::nullopt);
  camera.verticalFov = 2.0 * std::atan(std::tan(0.25) / 64.0);
  const SplatResult result = expectOneResult(scene, camera, Formula::normalised);
  EXPECT_GT(result.statistics.culledSplats, 0u);
}

TEST(Exactness, EyeInsideTheVolume) {
  const Scene scene = awkwardScene();
  Camera camera;
  camera.eye = scene.bounds().centre();
  camera.target = camera.eye + glm::dvec3(0.3, 0.2, -1.0);
  camera.verticalFov = 1.5;
  camera.imageSize = {123, 77};
  const SplatResult result = expectOneResult(scene, camera, Formula::direct);
  EXPECT_GT(result.statistics.culledSplats, 0u);
  for (const float value : resolve(result.sums, Formula::direct).pixels)
    EXPECT_TRUE(std::isfinite(value));
}

/// 1024 planes of opaque voxels behind one plane of thin fog, seen along the planes' axis.
Scene fogBeforeAWall() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(1.0), 0.0},
                     {1.0, glm::dvec3(1.0), 0.001},
                     {2.0, glm::dvec3(0.0, 1.0, 0.0), 1.0},
                     {255.0, glm::dvec3(0.0, 1.0, 0.0), 1.0}};
  return makeScene(makeVolume({9, 6, 1025}, glm::dvec3(1.0), [](int, int, int z) { return z == 1024 ? 1 : 2; }),
                   transfer, 8);
}

TEST(Exactness, AThousandOpaqueVoxelsBehindFog) {
  const Scene scene = fogBeforeAWall();
  for (const double height : {8.0, 8.0 / 64.0}) {
    const Camera camera = axisView(scene.bounds(), {48, 40}, height);
    const SplatResult result = expectOneResult(scene, camera, Formula::normalised);
    const Image picture = resolve(result.sums, Formula::normalised);
    // The middle pixel: fog emits 0.001 of white, the wall shines through the rest of it in green.
    const float* pixel = picture.at(24, 20);
    EXPECT_NEAR(pixel[0], 0.001, 1.0 / 255.0);
    EXPECT_NEAR(pixel[1], 1.0, 1.0 / 255.0);
    EXPECT_NEAR(pixel[3], 1.0, 1.0 / 255.0);
    const Image direct = resolve(expectOneResult(scene, camera, Formula::direct).sums, Formula::direct);
    EXPECT_NEAR(direct.at(24, 20)[0], 0.001, 1.0 / 255.0);
    EXPECT_NEAR(direct.at(24, 20)[1], 1.0, 1.0 / 255.0);
  }
}

// With far too fine a quantum the first sums are too large to be exact; the check must see that and redo them.
TEST(Exactness, TooFineAQuantumIsCaughtAndRaised) {
  const Scene scene = fogBeforeAWall();
  const Camera camera = axisView(scene.bounds(), {48, 40}, 8.0);
  SplatOptions options;
  options.footprint = Footprint::kernel;
  options.firstQuantum = 0x1p-26f;
  for (const Backend backend : {Backend::cpu, Backend::gl}) {
    const SplatResult result = splatScene(scene, camera, options, backend);
    EXPECT_EQ(result.statistics.passes, 3);  // 1.0 is 2^24 quanta of 2^-24
    EXPECT_EQ(result.sums.quantum, 0x1p-22f);
    EXPECT_TRUE(sumsAreExact(result.sums));
  }
}

// Frustum culling changes nothing: pictures of a part equal the part of a picture that has all blocks in view.
TEST(Exactness, CulledBlocksAddNothing) {
  const Scene scene = makeScene(
      makeVolume({140, 110, 27}, {1.0, 0.8, 1.3}, [](int x, int y, int z) { return (x * 31 + y * 17 + z * 13) % 256; }),
      whiteRamp(0.1), 8);
  const Camera whole = orbitCamera(scene.bounds(), {0.5, 0.3, 160.0}, {600, 500}, 0.9, std::nullopt);
  // The middle 25th: the same rays, a fifth of the field of view.
  Camera part = whole;
  part.imageSize = {120, 100};
  part.verticalFov = 2.0 * std::atan(std::tan(0.45) / 5.0);
  SplatOptions options;
  options.footprint = Footprint::kernel;
  const SplatResult large = splatScene(scene, whole, options);
  const SplatResult small = splatScene(scene, part, options);
  EXPECT_EQ(large.statistics.culledBlocks, 0u);
  EXPECT_GT(small.statistics.culledBlocks, 0u);
  double largest = 0.0;
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 120; ++x) {
      for (int c = 0; c < kSumChannels; ++c) {
        const double a = double(small.sums.image.at(x, y)[c]), b = double(large.sums.image.at(x + 240, y + 200)[c]);
        // The two cameras' pixel grids differ by float rounding, so that single quanta may move, also between the two
        // depth sums.
        if (c < 4) largest = std::max(largest, std::abs(a - b));
      }
      const float* a = small.sums.image.at(x, y);
      const float* b = large.sums.image.at(x + 240, y + 200);
      largest = std::max(largest, std::abs(double(a[4]) + double(a[5]) - double(b[4]) - double(b[5])));
    }
  }
  EXPECT_LT(largest, 2e-3);
}

TEST(Exactness, OtherOpacitiesThanTheFilesAreRefused) {
  const Scene scene = awkwardScene();
  TransferFunction other = scene.transfer;
  other.points[1].opacity = 0.2;
  const ValueGrid grid = scene.grid();
  EXPECT_THROW(Splatter(grid, scene.file.get(), other, Backend::cpu), InputError);
  TransferFunction recoloured = scene.transfer;
  recoloured.points[1].srgb = glm::dvec3(0.0, 0.0, 1.0);
  EXPECT_NO_THROW(Splatter(grid, scene.file.get(), recoloured, Backend::cpu));
}

}  // namespace
}  // namespace freevoxel
