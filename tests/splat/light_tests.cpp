// Lamps: shading, shadows and colours.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "splat/light_grid.h"
#include "tests/splat/scene.h"

namespace freevoxel {
namespace {

using namespace test;

TEST(Shade, LambertIsTheCosineOnTheSideThatFacesTheEye) {
  const glm::vec3 steep(0.0f, 0.0f, -0.5f), eye(0.0f, 0.0f, 1.0f);
  const Surface surface = surfaceFacing(steep, eye);
  EXPECT_FLOAT_EQ(surface.share, 1.0f);
  EXPECT_FLOAT_EQ(shade(Shading::lambert, surface, {0.0f, 0.0f, 1.0f}, eye), 1.0f);
  EXPECT_NEAR(shade(Shading::lambert, surface, {std::sin(1.0f), 0.0f, std::cos(1.0f)}, eye), std::cos(1.0f), 1e-6);
  EXPECT_FLOAT_EQ(shade(Shading::lambert, surface, {0.0f, 0.0f, -1.0f}, eye), 0.0f);
  EXPECT_FLOAT_EQ(shade(Shading::lambert, surfaceFacing(-steep, eye), {0.0f, 0.0f, 1.0f}, eye), 1.0f)
      << "either sign of the gradient";
  EXPECT_FLOAT_EQ(shade(Shading::lambert, surfaceFacing(glm::vec3(0.0f), eye), {0.0f, 0.0f, -1.0f}, eye), 1.0f)
      << "no surface";
  EXPECT_FLOAT_EQ(shade(Shading::none, surface, {0.0f, 0.0f, -1.0f}, eye), 1.0f);
}

TEST(Shade, PhongAddsAHighlightWhereTheMirroredLightMeetsTheEye) {
  const glm::vec3 steep(0.0f, 0.0f, 0.5f), ahead(0.0f, 0.0f, 1.0f);
  const glm::vec3 light(std::sin(0.5f), 0.0f, std::cos(0.5f)), mirrored(-light.x, 0.0f, light.z);
  EXPECT_NEAR(shade(Shading::phong, surfaceFacing(steep, mirrored), light, mirrored), std::cos(0.5f) + kPhongHighlight,
              1e-5);
  EXPECT_LE(shade(Shading::phong, surfaceFacing(steep, ahead), ahead, ahead), largestShade(Shading::phong));
}

TEST(Gradient, OfARampIsItsSlopeInWorldAxes) {
  // Value rises by 10 per voxel along x; the x axis points along world -y with spacing 2, the shortest edge is 0.5.
  Volume volume = makeVolume({9, 5, 7}, {2.0, 0.5, 1.0}, [](int x, int, int) { return 10 * x; });
  volume.header.placement.direction = glm::dmat3(glm::dvec3(0, -1, 0), glm::dvec3(1, 0, 0), glm::dvec3(0, 0, 1));
  const ValueGrid grid = valueGrid(volume, uniformOpacity(0.1));
  for (const int x : {0, 4, 8}) {
    const glm::vec3 gradient = gradientAt(grid, {x, 2, 3});
    EXPECT_NEAR(gradient.x, 0.0, 1e-7);
    EXPECT_NEAR(gradient.y, -10.0 / 255.0 / 2.0 * 0.5, 1e-7);
    EXPECT_NEAR(gradient.z, 0.0, 1e-7);
  }
}

LightGrid lightWithNothingInTheWay(const ValueGrid& grid, const Lighting& lighting) {
  LampAttenuation open;
  auto clear = std::make_shared<AttenuationGrid>();
  clear->values.assign(grid.codes.size(), 65535);
  open.grid = clear;
  const std::vector<LampAttenuation> attenuations(lighting.lights.size(), open);
  return lightGrid(grid, findVisibleCubes(grid, uniformOpacity(0.1)), nullptr, lighting, Camera{}, attenuations);
}

TEST(LightGrid, AddsAmbientAndLamps) {
  const ValueGrid grid =
      valueGrid(makeVolume({3, 4, 5}, glm::dvec3(1.0), [](int, int, int) { return 9; }), uniformOpacity(0.1));
  Lighting lighting;
  lighting.ambient = 0.25f;
  lighting.lights = {{true, {1, 0, 0}, {1.0f, 0.5f, 0.0f}}, {true, {0, 1, 0}, {0.0f, 0.5f, 2.0f}}};
  const LightGrid light = lightWithNothingInTheWay(grid, lighting);
  EXPECT_FLOAT_EQ(light.scale, 2.25f);
  for (const LightValue& value : light.values) {
    EXPECT_NEAR(value.red / 65535.0 * 2.25, 1.25, 1e-4);
    EXPECT_NEAR(value.green / 65535.0 * 2.25, 1.25, 1e-4);
    EXPECT_NEAR(value.blue / 65535.0 * 2.25, 2.25, 1e-4);
  }
  EXPECT_TRUE(lightWithNothingInTheWay(grid, Lighting{}).empty());
}

TEST(LightGrid, RefusesNonsense) {
  const ValueGrid grid =
      valueGrid(makeVolume({3, 4, 5}, glm::dvec3(1.0), [](int, int, int) { return 9; }), uniformOpacity(0.1));
  const auto light = [&](const Lighting& lighting) { lightWithNothingInTheWay(grid, lighting); };
  Lighting lighting;
  lighting.lights = {{true, {0, 0, 0}, glm::vec3(1.0f)}};
  EXPECT_THROW(light(lighting), InputError);
  lighting.lights = {{true, {1, 0, 0}, glm::vec3(NAN)}};
  EXPECT_THROW(light(lighting), InputError);
  lighting.lights.clear();
  lighting.ambient = -1.0f;
  EXPECT_THROW(light(lighting), InputError);
}

/// A small opaque ball floating above an opaque floor, white.
Scene ballAboveAFloor() {
  return makeScene(makeVolume({40, 30, 36}, glm::dvec3(1.0),
                              [](int x, int y, int z) {
                                const bool ball = std::hypot(x - 20.0, y - 15.0, z - 18.0) < 5.0;
                                return ball || y < 3 ? 255 : 0;
                              }),
                   uniformOpacity(0.9), 8, Classification::preintegrated);
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

TEST(Lights, ShadowFallsAwayFromTheLamp) {
  const Scene scene = ballAboveAFloor();
  Camera camera;
  camera.eye = {20.0, 200.0, 18.0};
  camera.target = {20.0, 0.0, 18.0};
  camera.up = {0.0, 0.0, -1.0};
  camera.orthographicHeight = 40.0;
  camera.imageSize = {160, 150};
  // The ball's centre is 12.5 above the floor; a lamp at 45 degrees from +x throws the shadow that far to -x.
  for (const AttenuationSource source : {AttenuationSource::interpolated, AttenuationSource::swept}) {
    for (const double side : {1.0, -1.0}) {
      SplatOptions options;
      options.attenuation = options.lightAttenuation = source;
      options.lighting.ambient = 0.1f;
      options.lighting.lights = {{true, {side, 1.0, 0.0}, glm::vec3(1.0f)}};
      const Image picture = resolve(splatScene(scene, camera, options).sums, Formula::normalised);
      EXPECT_LT(floorLight(picture, camera, 20.0 - side * 12.5, 18.0), 0.3) << int(source) << " " << side;
      EXPECT_GT(floorLight(picture, camera, 20.0 + side * 12.5, 18.0), 0.5) << int(source) << " " << side;
    }
  }
}

TEST(Lights, PicturesAreTheSameBitsOnBothBackends) {
  const Scene scene = ballAboveAFloor();
  SplatOptions options;
  options.lighting.ambient = 0.1f;
  options.lighting.shading = Shading::phong;
  options.lighting.lights = {{true, {1.0, 1.0, 0.3}, {1.0f, 0.3f, 0.2f}},
                             {false, {10.0, 25.0, 30.0}, {0.1f, 0.2f, 2.0f}}};
  const Camera camera = randomViews(scene.bounds(), 1, {70, 60}).front();
  for (const Footprint footprint : {Footprint::cell, Footprint::kernel}) {
    options.footprint = footprint;
    const SplatResult cpu = splatScene(scene, camera, options, Backend::cpu);
    const SplatResult gl = splatScene(scene, camera, options, Backend::gl);
    EXPECT_EQ(cpu.sums.image.pixels, gl.sums.image.pixels);
    EXPECT_GT(cpu.sums.lightScale, 2.0f);
  }
}

// One white lamp with nothing in between is the unlit picture.
TEST(Lights, ALampWithoutShadowsOrShadingChangesNothing) {
  const Scene scene = makeScene(
      makeVolume({9, 8, 7}, glm::dvec3(1.0), [](int x, int, int) { return x == 4 ? 200 : 0; }), uniformOpacity(0.3), 8);
  const Camera camera = randomViews(scene.bounds(), 1, {70, 60}).front();
  SplatOptions options;
  options.footprint = Footprint::kernel;
  const Image unlit = resolve(splatScene(scene, camera, options).sums, Formula::normalised);
  options.lighting.ambient = 0.0f;
  // Along x the single sheet of voxels has nothing before it, and `voxel` attenuation leaves out the voxel itself.
  options.lightAttenuation = AttenuationSource::interpolated;
  options.lighting.lights = {{true, {1.0, 0.0, 0.0}, glm::vec3(1.0f)}};
  const Image lit = resolve(splatScene(scene, camera, options).sums, Formula::normalised);
  for (size_t i = 0; i < lit.pixels.size(); ++i)
    EXPECT_NEAR(lit.pixels[i], unlit.pixels[i], 1e-4);
}

}  // namespace
}  // namespace freevoxel
