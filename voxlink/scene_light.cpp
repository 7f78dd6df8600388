#include "voxlink/scene_light.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "base/image.h"

namespace freevoxel {

std::vector<SceneLamp> sceneLamps(const SceneGrid& grid, const Lighting& lighting) {
  std::vector<SceneLamp> lamps;
  for (const Light& light : lighting.lights) {
    lamps.push_back({light.directional,
                     glm::vec3(light.directional ? glm::normalize(light.world) : grid.voxelsFromWorld(light.world)),
                     light.linear});
  }
  return lamps;
}

float sumScale(const Lighting& lighting) {
  glm::dvec3 brightest(double(lighting.ambient));
  for (const Light& light : lighting.lights)
    brightest += double(largestShade(lighting.shading)) * glm::dvec3(light.linear);
  const double most = std::max({brightest.r, brightest.g, brightest.b});
  // 1 % more for what light at the voxels of a volume is rounded up by.
  const double bits = most > 0.0 ? std::floor(31.0 - std::log2(1.01 * most)) : 24.0;
  return float(std::ldexp(1.0, int(std::min(bits, 24.0))));
}

Image picture(const std::vector<uint32_t>& sums, const Lighting& lighting, glm::ivec2 size) {
  Image image(size, 4);
  const double unit = 1.0 / double(sumScale(lighting));
  for (size_t i = 0; i < sums.size(); i += 4) {
    for (size_t c = 0; c < 3; ++c)
      image.pixels[i + c] = float(double(sums[i + c]) * unit);
    image.pixels[i + 3] = float(std::clamp(1.0 - double(sums[i + 3]) / double(kEscapeScale), 0.0, 1.0));
  }
  return image;
}

}  // namespace freevoxel
