#include "base/light.h"

namespace freevoxel {

float shade(Shading shading, glm::vec3 gradient, glm::vec3 towardsLight, glm::vec3 towardsEye) {
  const float steepness = glm::length(gradient);
  if (shading == Shading::none || steepness == 0.0f) return 1.0f;
  return shadeSurface(shading, gradient / steepness, std::min(1.0f, steepness / kSurfaceGradient), towardsLight,
                      towardsEye);
}

float largestShade(Shading shading) {
  return shading == Shading::phong ? 1.0f + kPhongHighlight : 1.0f;
}

}  // namespace freevoxel
