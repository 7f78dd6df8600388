#include "base/light.h"

#include "base/error.h"

namespace freevoxel {

void checkLighting(const Lighting& lighting) {
  for (const Light& light : lighting.lights) {
    for (int channel = 0; channel < 3; ++channel) {
      if (!(light.linear[channel] >= 0.0f) || !std::isfinite(light.linear[channel])) {
        throw InputError("light: colours must be finite and not negative");
      }
    }
    if (light.directional && glm::length(light.world) == 0.0) throw InputError("light: a direction must not be 0,0,0");
  }
  if (!(lighting.ambient >= 0.0f) || !std::isfinite(lighting.ambient)) {
    throw InputError("light: ambient must be finite and not negative");
  }
}

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
  return shadeSurface(shading, surface.normal, surface.share, towardsLight, towardsEye);
}

float largestShade(Shading shading) {
  return shading == Shading::phong ? 1.0f + kPhongHighlight : 1.0f;
}

}  // namespace freevoxel
