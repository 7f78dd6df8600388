#include "voxlink/trace_rays.h"

#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "voxlink/traversal.h"

namespace freevoxel {

namespace {

/// Every packed normal, and how much of a surface it is.
std::vector<glm::vec4> unpackedNormals() {
  std::vector<glm::vec4> normals(size_t(1) << 16);
  for (size_t i = 0; i < normals.size(); ++i)
    shared::unpackNormal(uint32_t(i), normals[i].x, normals[i].y, normals[i].z, normals[i].w);
  return normals;
}

}  // namespace

std::vector<uint32_t> lightVoxels(const VoxLinkBuffers& buffers, const Lighting& lighting, const LightShares& shares,
                                  const Camera& camera) {
  checkLighting(lighting);
  const size_t fragments = buffers.fragments.size();
  checkEqual(shares.size(), fragments * lighting.lights.size(), "shares of light");
  std::vector<uint32_t> light(fragments);
  // Places are in shortest voxel edges from voxel (0,0,0), along the axes of the world.
  const double unit = buffers.placement.unitLength();
  const auto placeOf = [&](glm::dvec3 world) { return glm::vec3((world - buffers.placement.origin) / unit); };
  glm::mat3 lengthFromIndex(1.0f);
  for (int axis = 0; axis < 3; ++axis)
    lengthFromIndex[axis] = glm::vec3(buffers.placement.direction[axis] * (buffers.placement.spacing[axis] / unit));
  struct Lamp {
    bool directional;
    glm::vec3 place, linear;
  };
  std::vector<Lamp> lamps;
  for (const Light& lamp : lighting.lights) {
    lamps.push_back({lamp.directional, lamp.directional ? glm::vec3(glm::normalize(lamp.world)) : placeOf(lamp.world),
                     lamp.linear});
  }
  const bool orthographic = camera.orthographicHeight.has_value();
  const glm::vec3 eye = orthographic ? glm::vec3(glm::normalize(camera.eye - camera.target)) : placeOf(camera.eye);
  const std::vector<glm::vec4> normals = unpackedNormals();
  forEachStoredVoxel(buffers, [&](size_t fragment, glm::ivec3 voxel) {
    glm::vec3 sum(lighting.ambient);
    const glm::vec4 normal = normals[shared::fragmentNormal(buffers.fragments[fragment])];
    const glm::vec3 place = lengthFromIndex * glm::vec3(voxel);
    const glm::vec3 toEye = orthographic ? eye : eye - place;
    const float eyeDistance = glm::length(toEye);
    const bool shaded = lighting.shading != Shading::none && normal.w > 0.0f && eyeDistance > 0.0f;
    const glm::vec3 towardsEye = toEye * (1.0f / std::max(eyeDistance, 1e-30f));
    for (size_t n = 0; n < lamps.size(); ++n) {
      const uint8_t code = shares[n * fragments + fragment];
      if (code == 0) continue;
      float share = float(code) * (1.0f / 255.0f);
      if (shaded) {
        glm::vec3 towardsLight = lamps[n].place;
        bool apart = true;
        if (!lamps[n].directional) {
          towardsLight -= place;
          const float distance = glm::length(towardsLight);
          apart = distance > 0.0f;
          towardsLight *= 1.0f / std::max(distance, 1e-30f);
        }
        if (apart) share *= shadeSurface(lighting.shading, glm::vec3(normal), normal.w, towardsLight, towardsEye);
      }
      sum += lamps[n].linear * share;
    }
    light[fragment] = shared::packLight(sum.r, sum.g, sum.b);
  });
  return light;
}

Image traceRays(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                std::span<const uint32_t> light, const Camera& camera, Progress& progress) {
  check(light.empty() || light.size() == buffers.fragments.size(), "every fragment has light");
  const ViewFrame frame = viewFrame(camera);
  const glm::dmat4 indexFromWorld = glm::inverse(buffers.placement.worldFromIndex());
  const double unit = buffers.placement.unitLength();
  Image picture(camera.imageSize, 4);
  progress.begin("tracing", uint64_t(camera.imageSize.y), "rows");
#pragma omp parallel for schedule(dynamic, 4)
  for (int y = 0; y < camera.imageSize.y; ++y) {
    for (int x = 0; x < camera.imageSize.x; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
      const glm::dvec3 origin = glm::dvec3(indexFromWorld * glm::dvec4(ray.origin, 1.0)) + 0.5;
      const glm::dvec3 direction(indexFromWorld * glm::dvec4(ray.direction * unit, 0.0));
      glm::vec3 gathered(0.0f);
      float through = 1.0f;
      traverse(buffers, origin, direction, 0.0, [&](size_t fragment, glm::ivec3, double from, double to) {
        const VoxelMaterial& material = materials[shared::fragmentCode(buffers.fragments[fragment])];
        const float passed = std::exp(-material.extinction * float(to - from));
        glm::vec3 colour(material.red, material.green, material.blue);
        if (!light.empty()) {
          glm::vec3 arriving;
          shared::unpackLight(light[fragment], arriving.r, arriving.g, arriving.b);
          colour *= arriving;
        }
        gathered += through * (1.0f - passed) * colour;
        through *= passed;
        return through >= shared::kOpaqueEnough;
      });
      float* pixel = picture.at(x, y);
      pixel[0] = gathered.r;
      pixel[1] = gathered.g;
      pixel[2] = gathered.b;
      pixel[3] = 1.0f - through;
    }
#pragma omp critical(freevoxelTraceProgress)
    progress.advance(1);
  }
  progress.end();
  return picture;
}

}  // namespace freevoxel
