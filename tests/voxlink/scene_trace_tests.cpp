// Pictures of scenes: Snell, mirrors, opacity transport, shadows, no holes; and the two tracers against each other.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <optional>

#include "base/compare.h"
#include "base/error.h"
#include "shaders/shared/scene_voxel.h"
#include "tests/support/test_data.h"
#include "tests/voxlink/surface_scenes.h"
#include "voxlink/scene.h"

namespace freevoxel {
namespace {

using namespace test;
using glm::dvec3;
using glm::vec3;

/// From above, where lamps shine.
Camera viewFromAbove(const TracedScene& scene, glm::ivec2 size) {
  return orbitCamera(sceneBounds(scene), {.azimuth = 0.6, .elevation = 0.5}, size, 0.5, std::nullopt);
}

Image traceUnlit(const TracedScene& scene, const Camera& camera, const SceneVoxLinkOptions& options) {
  SceneVoxLink voxlink(scene, options, nullptr, silentProgress());
  return voxlink.trace(camera, silentProgress());
}

// ---- opacity transport (papers/voxlink section 5.2.1) ----

// The paper's alphaAB and alphaAC at alpha' = 0.5, and three nested splits.
TEST(OpacityTransport, SharesAreThePapers) {
  const float beta = 0.3f;
  const shared::SurfaceMaterial material{1, 1, 1, 0.5f, beta, 1.5f, shared::kGlass, 0};
  const vec3 direction(0, 0, -1), normal(0, 0, 1);
  const auto split = [&](float through) {
    return shared::splitRay(material, 1, through * (1.0f - material.opacity), direction, normal, false, 0, false);
  };
  const shared::Split first = split(1.0f);
  const float alpha = 0.5f;  // alpha' = alpha0 + (1 - alpha0) alphaA, alpha0 = 0
  EXPECT_FLOAT_EQ(1.0f - first.straight, 1.0f - (1.0f - beta) * (1.0f - alpha));
  EXPECT_FLOAT_EQ(1.0f - first.mirrored, 1.0f - beta * (1.0f - alpha));
  float sum = 0.0f;
  for (const float a : {first.straight, first.mirrored}) {
    for (const float b : {split(a).straight, split(a).mirrored})
      sum += split(b).straight + split(b).mirrored;
  }
  EXPECT_NEAR(sum, std::pow(1.0f - alpha, 3.0f), 1e-6f);
}

// Figure 5: voxel A splits the ray, B is behind it, C where it is reflected to; colours and weights of the picture.
TEST(OpacityTransport, FigureFiveIsThePicture) {
  const float beta = 0.3f, opacity = 0.5f;
  TracedScene scene;
  const vec3 a(0.2f, 0.4f, 0.6f), b(0.9f, 0.1f, 0.1f), c(0.1f, 0.8f, 0.3f);
  // Index 1: B is met straight behind A.
  const uint32_t glass = addMaterial(scene.mesh, a, MaterialKind::glass, opacity, beta, 1.0f);
  const uint32_t behind = addMaterial(scene.mesh, b), aside = addMaterial(scene.mesh, c);
  addQuad(scene.mesh, {-2, -2, 2}, {4, 0, -4}, {0, 4, 0}, glass);  // leans by 45 degrees: x + z = 0
  addQuad(scene.mesh, {-3, -3, -5}, {6, 0, 0}, {0, 6, 0}, behind);
  addQuad(scene.mesh, {5, -3, 3}, {0, 0, -6}, {0, 6, 0}, aside);
  Camera camera;
  camera.eye = {0, 0, 20};
  camera.imageSize = {3, 3};
  camera.verticalFov = 0.02;
  const Image picture = traceUnlit(scene, camera, {.resolution = 40});
  for (int channel = 0; channel < 3; ++channel) {
    const float alphaAB = 1.0f - (1.0f - beta) * (1.0f - opacity), alphaAC = 1.0f - beta * (1.0f - opacity);
    const float expected = opacity * a[channel] + b[channel] * (1.0f - alphaAB) + c[channel] * (1.0f - alphaAC);
    EXPECT_NEAR(picture.at(1, 1)[channel], expected, 1e-5f);
  }
  EXPECT_NEAR(picture.at(1, 1)[3], 1.0f, 1e-6f);
}

// Without anything behind, what escapes of all rays together is what the surfaces leave.
TEST(OpacityTransport, NothingIsLostOverNestedSplits) {
  TracedScene scene;
  const uint32_t glass = addMaterial(scene.mesh, vec3(0.5f), MaterialKind::glass, 0.0f, 0.4f, 1.0f);
  for (int i = 0; i < 3; ++i)
    addQuad(scene.mesh, {-2, -2, float(3 * i)}, {4, 0, 1}, {0, 4, 1}, glass);
  Camera camera;
  camera.eye = {0, 0, 40};
  camera.imageSize = {3, 3};
  camera.verticalFov = 0.02;
  const Image picture = traceUnlit(scene, camera, {.resolution = 40, .maxDepth = 60});
  EXPECT_NEAR(picture.at(1, 1)[3], 0.0f, 2e-3f);  // rays of less than 2^-12 end
}

// ---- refraction and reflection ----

/// A wall of stripes of two colours behind z = 0, each `width` wide in x.
void addStripes(Mesh& mesh, float z, float width, int count) {
  const uint32_t red = addMaterial(mesh, {1, 0, 0}), green = addMaterial(mesh, {0, 1, 0});
  for (int i = -count; i < count; ++i)
    addQuad(mesh, {float(i) * width, -float(count) * width, z}, {width, 0, 0}, {0, 2 * float(count) * width, 0},
            i & 1 ? red : green);
}
/// Distance of a place to the nearest border of stripes, and whether the stripe is green.
bool isGreen(double x, double width, double& border) {
  const double at = x / width;
  border = std::abs(at - std::round(at)) * width;
  return (int(std::floor(at)) & 1) == 0;
}

/// Where a ray leaves a glass sphere at the origin, by Snell's law with doubles; nothing at total reflection.
bool throughSphere(double radius, double index, dvec3& place, dvec3& direction) {
  const auto bend = [](dvec3 d, dvec3 n, double ratio) {
    const double cosine = -glm::dot(d, n), inner = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    return ratio * d + (ratio * cosine - std::sqrt(inner)) * n;
  };
  const double along = -glm::dot(place, direction);
  const double miss = glm::dot(place, place) - along * along;
  if (miss >= radius * radius) return false;
  place += (along - std::sqrt(radius * radius - miss)) * direction;
  direction = bend(direction, place / radius, 1.0 / index);
  place += -2.0 * glm::dot(place, direction) * direction;
  direction = bend(direction, -place / radius, index);
  return true;
}

void expectSnell(bool implicit, double tolerance, double mostWrong) {
  const double radius = 2.0, index = 1.5, width = 0.5;
  TracedScene scene;
  addStripes(scene.mesh, -4.0f, float(width), 14);
  if (implicit) {
    scene.spheres.materials = {{"", MaterialKind::glass, vec3(1.0f), 0.0f, 0.0f, float(index)}};
    addSphere(scene.spheres, vec3(0.0f), float(radius), 0);
  } else {
    const uint32_t glass = addMaterial(scene.mesh, vec3(1.0f), MaterialKind::glass, 0.0f, 0.0f, float(index));
    addEllipsoid(scene.mesh, vec3(0.0f), vec3(float(radius)), 60, glass, true);
  }
  Camera camera;
  camera.eye = {0.3, 0.2, 12};
  camera.imageSize = {93, 81};
  camera.verticalFov = 0.34;
  const Image picture = traceUnlit(scene, camera, {.resolution = 200});
  const ViewFrame frame = viewFrame(camera);
  int judged = 0, wrong = 0;
  for (int y = 0; y < camera.imageSize.y; ++y) {
    for (int x = 0; x < camera.imageSize.x; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
      dvec3 place = ray.origin, direction = ray.direction;
      const double edge = glm::length(place + -glm::dot(place, direction) * direction);
      if (edge > 0.8 * radius || !throughSphere(radius, index, place, direction)) continue;
      place += (-4.0 - place.z) / direction.z * direction;
      double border = 0.0;
      const bool green = isGreen(place.x, width, border);
      if (border < tolerance || std::abs(place.x) > 6.5 || std::abs(place.y) > 6.5) continue;
      ++judged;
      const float* pixel = picture.at(x, y);
      if ((pixel[1] > pixel[0]) != green) ++wrong;
      EXPECT_NEAR(pixel[3], 1.0f, 1e-3f) << x << "," << y;
    }
  }
  EXPECT_GT(judged, 800);
  EXPECT_LE(wrong, mostWrong * judged) << "of " << judged;
}

// An implicit sphere is exact; stripes are as sharp as voxels (0.07), seen at a slant.
TEST(Refraction, ImplicitSphereFollowsSnell) {
  expectSnell(true, 0.1, 0.0);
}
// Normals of 0.8 degrees put the ray behind two refractions off by about 0.1 after 6 lengths.
TEST(Refraction, VoxelisedSphereFollowsSnell) {
  expectSnell(false, 0.15, 0.02);
}

TEST(Reflection, MirrorFollowsTheLaw) {
  const double width = 0.5;
  TracedScene scene;
  addStripes(scene.mesh, 5.0f, float(width), 14);
  const uint32_t mirror = addMaterial(scene.mesh, vec3(1.0f), MaterialKind::mirror, 0.0f);
  // A plane that leans: its normal is (0.3, 0.2, 1), not along any axis.
  const dvec3 normal = glm::normalize(dvec3(0.3, 0.2, 1.0));
  const vec3 a = 3.0f * vec3(glm::normalize(glm::cross(dvec3(0, 1, 0), normal))),
             b(3.0f * vec3(glm::cross(normal, dvec3(glm::normalize(a)))));
  addQuad(scene.mesh, vec3(0, 0, -3) - 0.5f * a - 0.5f * b, a, b, mirror);
  Camera camera;
  camera.eye = {0.2, 0.1, 4};
  camera.target = {0, 0, -3};
  camera.imageSize = {73, 61};
  camera.verticalFov = 0.3;
  const Image picture = traceUnlit(scene, camera, {.resolution = 200});
  const ViewFrame frame = viewFrame(camera);
  int judged = 0, wrong = 0;
  for (int y = 0; y < camera.imageSize.y; ++y) {
    for (int x = 0; x < camera.imageSize.x; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
      const dvec3 hit =
          ray.origin + glm::dot(dvec3(0, 0, -3) - ray.origin, normal) / glm::dot(ray.direction, normal) * ray.direction;
      const dvec3 direction = glm::reflect(ray.direction, normal);
      const dvec3 place = hit + (5.0 - hit.z) / direction.z * direction;
      double border = 0.0;
      const bool green = isGreen(place.x, width, border);
      // Half a step of the normal (0.8 degrees at most) turns the ray twofold: 0.22 after 8 lengths.
      if (border < 0.23 || std::abs(place.x) > 6.5 || std::abs(place.y) > 6.5) continue;
      ++judged;
      if ((picture.at(x, y)[1] > picture.at(x, y)[0]) != green) ++wrong;
    }
  }
  EXPECT_GT(judged, 200);
  EXPECT_EQ(wrong, 0) << "of " << judged;
}

// ---- holes and shadows ----

// Every ray that goes through a thin closed shell meets it, from whatever side, at coarse and fine resolutions.
TEST(Holes, ThereAreNoneInThinWalls) {
  for (const int resolution : {13, 40, 77}) {
    TracedScene scene;
    const uint32_t material = addMaterial(scene.mesh, vec3(0.7f));
    addEllipsoid(scene.mesh, {0.3f, 0.2f, 0.1f}, {2.5f, 3.5f, 5.5f}, 20, material, resolution == 40);
    Camera camera;
    camera.eye = {0.4, 0.1, 0.2};
    camera.verticalFov = 2.0;
    camera.imageSize = {91, 63};
    for (const dvec3 direction : {dvec3(1, 0.2, 0.1), dvec3(-0.3, 0.4, 1), dvec3(0.5, -1, -0.6), dvec3(0, 0, 1)}) {
      camera.target = camera.eye + direction;
      const Image picture = traceUnlit(scene, camera, {.resolution = resolution});
      for (size_t i = 0; i < picture.pixels.size(); i += 4)
        ASSERT_EQ(picture.pixels[i + 3], 1.0f) << resolution << ": pixel " << i / 4;
    }
  }
}

// A ball above a floor: the shadow is where the lamp's rays are, and nowhere else.
TEST(Shadows, FallWhereTheyShould) {
  TracedScene scene;
  const uint32_t white = addMaterial(scene.mesh, vec3(1.0f));
  addQuad(scene.mesh, {-5, 0, 5}, {10, 0, 0}, {0, 0, -10}, white);
  scene.spheres.materials.emplace_back();
  addSphere(scene.spheres, {0.5f, 3.0f, -0.5f}, 1.0f, 0);
  Lighting lighting;
  lighting.ambient = 0.1f;
  lighting.shading = Shading::lambert;
  const dvec3 lamp(3.0, 8.0, 1.0);
  lighting.lights = {{false, lamp, vec3(0.9f)}};
  Camera camera;
  camera.eye = {0, 14, 9};
  camera.imageSize = {101, 83};
  camera.verticalFov = 0.6;
  for (const bool gpu : {false, true}) {
    std::optional<gl::Context> context;
    if (gpu) context.emplace();
    SceneVoxLink voxlink(scene, {.resolution = 128}, gpu ? &*context : nullptr, silentProgress());
    voxlink.light(lighting, Shadows::rays);
    const Image picture = voxlink.trace(camera, silentProgress());
    const ViewFrame frame = viewFrame(camera);
    int dark = 0;
    for (int y = 0; y < camera.imageSize.y; ++y) {
      for (int x = 0; x < camera.imageSize.x; ++x) {
        const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
        const dvec3 centre(0.5, 3.0, -0.5);
        const auto missDistance = [&](dvec3 origin, dvec3 direction) {
          const dvec3 to = centre - origin;
          return glm::length(to - glm::dot(to, direction) * direction);
        };
        if (missDistance(ray.origin, ray.direction) < 1.1) continue;  // the ball itself
        const dvec3 place = ray.origin - ray.origin.y / ray.direction.y * ray.direction;
        if (std::abs(place.x) > 4.8 || std::abs(place.z) > 4.8) continue;
        const dvec3 towards = glm::normalize(lamp - place);
        const double miss = missDistance(place, towards);
        if (std::abs(miss - 1.0) < 0.05) continue;
        const float expected = miss < 1.0 ? 0.1f : 0.1f + 0.9f * float(towards.y);
        // Half a step of the packed normal.
        ASSERT_NEAR(picture.at(x, y)[0], expected, 0.015f) << x << "," << y;
        dark += miss < 1.0 ? 1 : 0;
      }
    }
    EXPECT_GT(dark, 100);
  }
}

// Scanned meshes have triangles that are turned over. Where the mesh is smooth they do not show: neither as dark specks
// in their own shadow nor as surfaces that are seen from behind.
TEST(Shadows, TrianglesThatAreTurnedOverDoNotShow) {
  TracedScene scene;
  const uint32_t red = addMaterial(scene.mesh, {0.8f, 0.3f, 0.2f});
  addEllipsoid(scene.mesh, {0.1f, 0.0f, 0.2f}, {1.0f, 1.3f, 0.8f}, 40, red, true);
  TracedScene turned = scene;
  for (size_t i = 0; i < turned.mesh.triangles.size(); i += 13)
    std::swap(turned.mesh.triangles[i].x, turned.mesh.triangles[i].y);
  const Camera camera = viewFromAbove(scene, {90, 80});
  const auto picture = [&](const TracedScene& traced) {
    SceneVoxLink voxlink(traced, {.resolution = 150}, nullptr, silentProgress());
    voxlink.light(twoLamps(), Shadows::rays);
    return voxlink.trace(camera, silentProgress());
  };
  const Image expected = picture(scene), found = picture(turned);
  size_t covered = 0, specks = 0;
  for (size_t i = 0; i < found.pixels.size(); i += 4) {
    covered += expected.pixels[i + 3] > 0.5f ? 1 : 0;
    specks += std::abs(found.pixels[i] - expected.pixels[i]) > 0.05f ? 1 : 0;
  }
  EXPECT_GT(covered, 1000u);
  EXPECT_LE(specks, covered / 500);
}

// The normal for light goes on smoothly from voxel to voxel: across an ellipsoid neighbouring pixels differ no more
// than its curvature makes them.
TEST(Normals, AreBlendedBetweenVoxels) {
  TracedScene scene;
  const uint32_t white = addMaterial(scene.mesh, vec3(1.0f));
  addEllipsoid(scene.mesh, vec3(0.0f), {1.0f, 1.0f, 1.0f}, 60, white, true);
  Camera camera;
  camera.eye = {0.0, 0.0, 9.0};
  camera.orthographicHeight = 1.0;
  camera.imageSize = {160, 150};
  SceneVoxLink voxlink(scene, {.resolution = 40}, nullptr, silentProgress());
  Lighting lighting;
  lighting.ambient = 0.0f;
  lighting.shading = Shading::lambert;
  lighting.lights = {{true, {1.0, 0.0, 1.0}, vec3(1.0f)}};
  voxlink.light(lighting, Shadows::none);
  const Image picture = voxlink.trace(camera, silentProgress());
  float worst = 0.0f;
  for (int y = 0; y < camera.imageSize.y; ++y) {
    for (int x = 0; x + 1 < camera.imageSize.x; ++x)
      worst = std::max(worst, std::abs(picture.at(x + 1, y)[0] - picture.at(x, y)[0]));
  }
  // A pixel is 1/150 across: 0.007 of curvature. One normal a voxel, 1/20 wide, would jump by 0.035 and more.
  EXPECT_LE(worst, 0.016f);
}

// ---- the two tracers ----

// Floats put a ray that grazes an edge into another voxel, and glass carries that on: such pixels are few, and brighter
// as often as darker. Elsewhere the tracers agree to 0.01 (a highlight's power of 24 between floats and doubles).
TEST(SceneTracers, AgreeOnEverythingTogether) {
  gl::Context context;
  for (const bool volume : {false, true}) {
    const TracedScene scene = mixedScene(volume, true);
    SceneVoxLink cpu(scene, {.resolution = 60}, nullptr, silentProgress());
    SceneVoxLink gpu(scene, {.resolution = 60}, &context, silentProgress());
    for (const Shadows shadows : {Shadows::rays, Shadows::none}) {
      cpu.light(twoLamps(), shadows);
      gpu.light(twoLamps(), shadows);
      std::vector<Camera> cameras = viewsOf(sceneBounds(scene), 1, {91, 67});
      cameras.push_back(viewFromAbove(scene, {91, 67}));
      for (const Camera& camera : cameras) {
        const Image expected = cpu.trace(camera, silentProgress());
        const TracerDifference difference = compareTracers(gpu.trace(camera, silentProgress()), expected, 1e-2f);
        EXPECT_GT(difference.covered, 1000u);
        EXPECT_LE(double(difference.flipped), 0.03 * double(difference.covered));
        EXPECT_LE(std::abs(difference.meanFlip), 1e-3);
        EXPECT_NEAR(double(gpu.statistics().rays), double(cpu.statistics().rays), 0.01 * double(cpu.statistics().rays));
      }
    }
  }
  for (const std::string& error : context.takeErrors())
    ADD_FAILURE() << error;
}

TEST(SceneTracers, StepsAndRayBufferChangeNoBit) {
  gl::Context context;
  const TracedScene scene = mixedScene(true, false);
  const Camera camera = viewFromAbove(scene, {61, 43});
  std::optional<Image> expected;
  for (const SceneVoxLinkOptions& options :
       {SceneVoxLinkOptions{.resolution = 45}, SceneVoxLinkOptions{.resolution = 45, .steps = 3},
        SceneVoxLinkOptions{.resolution = 45, .rayBuffer = 60000},
        SceneVoxLinkOptions{.resolution = 45, .steps = 40, .rayBuffer = 1 << 18}}) {
    SceneVoxLink gpu(scene, options, &context, silentProgress());
    gpu.light(twoLamps(), Shadows::rays);
    const Image picture = gpu.trace(camera, silentProgress());
    if (!expected) expected = picture;
    EXPECT_EQ(picture.pixels, expected->pixels) << options.steps << " " << options.rayBuffer;
    EXPECT_GT(gpu.statistics().passes, options.rayBuffer == 60000 ? 20 : 1);
  }
  for (const std::string& error : context.takeErrors())
    ADD_FAILURE() << error;
}

// Brick sizes only skip.
TEST(SceneTracers, BrickSizeChangesNothing) {
  const TracedScene scene = mixedScene(true, true);
  const Camera camera = viewFromAbove(scene, {81, 63});
  const Image four = traceUnlit(scene, camera, {.resolution = 45, .brickEdge = 4});
  for (const int edge : {8, 16}) {
    const TracerDifference difference =
        compareTracers(traceUnlit(scene, camera, {.resolution = 45, .brickEdge = edge}), four, 1e-4f);
    EXPECT_LE(double(difference.flipped), 2e-3 * double(difference.covered));
  }
}

// A scene that moves, voxelised again, is the scene built anew.
TEST(SceneTracers, UpdateIsABuildAnew) {
  TracedScene scene = mixedScene(false, true);
  const Camera camera = viewFromAbove(scene, {61, 43});
  SceneVoxLink moving(scene, {.resolution = 40}, nullptr, silentProgress());
  moving.light(twoLamps(), Shadows::rays);
  const Image before = moving.trace(camera, silentProgress());
  scene.spheres.centres[0].y += 1.0f;
  moving.update(scene, silentProgress());
  SceneVoxLink anew(scene, {.resolution = 40}, nullptr, silentProgress());
  anew.light(twoLamps(), Shadows::rays);
  const Image after = moving.trace(camera, silentProgress());
  EXPECT_EQ(after.pixels, anew.trace(camera, silentProgress()).pixels);
  EXPECT_NE(after.pixels, before.pixels);
}

// A mirror at the depth limit shows no more; glass lets through.
TEST(SceneTracers, DepthIsBounded) {
  TracedScene scene;
  const uint32_t mirror = addMaterial(scene.mesh, vec3(1.0f), MaterialKind::mirror, 0.0f);
  addQuad(scene.mesh, {-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, mirror);
  addQuad(scene.mesh, {-2, -2, 1}, {0, 4, 0}, {4, 0, 0}, mirror);
  Camera camera;
  camera.eye = {0.1, 0.0, 0.0};
  camera.target = {0.1, 0.0, -1.0};
  camera.imageSize = {5, 3};
  for (const int depth : {0, 1, 64}) {
    const Image picture = traceUnlit(scene, camera, {.resolution = 32, .maxDepth = depth});
    EXPECT_EQ(picture.at(2, 1)[3], 1.0f);
    EXPECT_EQ(picture.at(2, 1)[0], 0.0f);
  }
}

TEST(SceneTracers, AttenuationIsForVolumesAlone) {
  SceneVoxLink voxlink(mixedScene(false, false), {.resolution = 20}, nullptr, silentProgress());
  EXPECT_THROW(voxlink.light(twoLamps(), Shadows::attenuation), InputError);
}

}  // namespace
}  // namespace freevoxel
