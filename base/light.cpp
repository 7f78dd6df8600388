#include "base/light.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace freevoxel {

namespace {

/// cosine^kPhongExponent is below 2^-24 from here down.
constexpr float kNoHighlight = 0.5f;

}  // namespace

Surface surfaceFacing(glm::vec3 gradient, glm::vec3 towardsEye) {
  const float steepness = glm::length(gradient);
  Surface surface;
  if (!(steepness > 0.0f)) return surface;
  surface.normal = gradient / steepness;
  if (glm::dot(surface.normal, towardsEye) < 0.0f) surface.normal = -surface.normal;
  surface.share = std::min(1.0f, steepness / kSurfaceGradient);
  return surface;
}

float shade(Shading shading, const Surface& surface, glm::vec3 towardsLight, glm::vec3 towardsEye) {
  if (shading == Shading::none || surface.share == 0.0f) return 1.0f;
  const float cosine = std::max(0.0f, glm::dot(surface.normal, towardsLight));
  float shaded = cosine;
  if (shading == Shading::phong && cosine > 0.0f) {
    const float mirrored = glm::dot(2.0f * cosine * surface.normal - towardsLight, towardsEye);
    if (mirrored > kNoHighlight) shaded += kPhongHighlight * std::pow(mirrored, kPhongExponent);
  }
  return 1.0f + surface.share * (shaded - 1.0f);
}

float largestShade(Shading shading) {
  return shading == Shading::phong ? 1.0f + kPhongHighlight : 1.0f;
}

}  // namespace freevoxel
