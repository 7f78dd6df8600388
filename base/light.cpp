#include "base/light.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace freevoxel {

float shade(Shading shading, glm::vec3 gradient, glm::vec3 towardsLight, glm::vec3 towardsEye) {
  const float steepness = glm::length(gradient);
  if (shading == Shading::none || steepness == 0.0f) return 1.0f;
  glm::vec3 normal = gradient / steepness;
  if (glm::dot(normal, towardsEye) < 0.0f) normal = -normal;
  const float cosine = std::max(0.0f, glm::dot(normal, towardsLight));
  float shaded = cosine;
  if (shading == Shading::phong && cosine > 0.0f) {
    const glm::vec3 mirrored = 2.0f * cosine * normal - towardsLight;
    shaded += kPhongHighlight * std::pow(std::max(0.0f, glm::dot(mirrored, towardsEye)), kPhongExponent);
  }
  const float surface = std::min(1.0f, steepness / kSurfaceGradient);
  return 1.0f + surface * (shaded - 1.0f);
}

float largestShade(Shading shading) {
  return shading == Shading::phong ? 1.0f + kPhongHighlight : 1.0f;
}

}  // namespace freevoxel
