#include "splat/light_grid.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

LightGrid lightGrid(const ValueGrid& grid, const Lighting& lighting, const Camera& camera,
                    const std::function<AttenuationGrid(const Light&)>& attenuation) {
  LightGrid result;
  if (lighting.unlit()) return result;
  glm::vec3 largest(lighting.ambient);
  for (const Light& light : lighting.lights) {
    for (int channel = 0; channel < 3; ++channel) {
      if (!(light.linear[channel] >= 0.0f) || !std::isfinite(light.linear[channel])) {
        throw InputError("light: colours must be finite and not negative");
      }
    }
    largest += light.linear * largestShade(lighting.shading);
  }
  if (!(lighting.ambient >= 0.0f) || !std::isfinite(lighting.ambient)) {
    throw InputError("light: ambient must be finite and not negative");
  }
  result.scale = std::max({largest.x, largest.y, largest.z});
  result.values.resize(grid.codes.size());
  if (!(result.scale > 0.0f)) {
    result.scale = 1.0f;
    return result;
  }
  const float perScale = 1.0f / result.scale;

  std::vector<glm::vec3> sums(grid.codes.size(), glm::vec3(lighting.ambient));
  const glm::dmat4 worldFromIndex = grid.placement.worldFromIndex();
  const glm::dvec3 towardsOrthographicEye = glm::normalize(camera.eye - camera.target);
  for (const Light& light : lighting.lights) {
    if (light.directional && glm::length(light.world) == 0.0) throw InputError("light: a direction must not be 0,0,0");
    const AttenuationGrid arriving = attenuation(light);
    const glm::dvec3 direction = light.directional ? glm::normalize(light.world) : glm::dvec3(0.0);
#pragma omp parallel for schedule(dynamic, 1)
    for (int z = 0; z < grid.dims.z; ++z) {
      for (int y = 0; y < grid.dims.y; ++y) {
        for (int x = 0; x < grid.dims.x; ++x) {
          const uint64_t at = linearIndex({x, y, z}, grid.dims);
          const float passed = float(arriving.values[at]) * (1.0f / AttenuationGrid::kUnit);
          if (passed == 0.0f) continue;
          float share = 1.0f;
          if (lighting.shading != Shading::none) {
            const glm::dvec3 world(worldFromIndex * glm::dvec4(x, y, z, 1.0));
            const glm::dvec3 toLight = light.directional ? direction : light.world - world;
            const glm::dvec3 toEye = camera.orthographicHeight ? towardsOrthographicEye : camera.eye - world;
            const double lightDistance = glm::length(toLight), eyeDistance = glm::length(toEye);
            if (lightDistance > 0.0 && eyeDistance > 0.0) {
              share = shade(lighting.shading, gradientAt(grid, {x, y, z}), glm::vec3(toLight / lightDistance),
                            glm::vec3(toEye / eyeDistance));
            }
          }
          sums[at] += light.linear * (passed * share);
        }
      }
    }
  }
#pragma omp parallel for schedule(static)
  for (int64_t i = 0; i < int64_t(sums.size()); ++i) {
    const glm::vec3 value = glm::clamp(sums[size_t(i)] * perScale, 0.0f, 1.0f) * LightGrid::kUnit + 0.5f;
    result.values[size_t(i)] = {uint16_t(value.r), uint16_t(value.g), uint16_t(value.b), 0};
  }
  return result;
}

}  // namespace freevoxel
