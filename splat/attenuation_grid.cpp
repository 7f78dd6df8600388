#include "splat/attenuation_grid.h"

#include <glm/glm.hpp>

namespace freevoxel {

Towards Towards::point(const Placement& placement, glm::dvec3 world) {
  Towards towards;
  towards.index = glm::dvec3(glm::inverse(placement.worldFromIndex()) * glm::dvec4(world, 1.0));
  for (int axis = 0; axis < 3; ++axis) {
    towards.lengthFromIndex[axis] = placement.direction[axis] * (placement.spacing[axis] / placement.unitLength());
  }
  return towards;
}

Towards Towards::direction(const Placement& placement, glm::dvec3 world) {
  Towards towards = point(placement, world);
  towards.directional = true;
  towards.index = glm::inverse(towards.lengthFromIndex) * world;
  return towards;
}

Towards Towards::ofLevel(int level) const {
  Towards result = *this;
  const double voxels = double(1 << level);
  if (!directional) result.index = (index - 0.5 * (voxels - 1.0)) / voxels;
  return result;
}

bool Towards::inside(glm::ivec3 dims) const {
  return !directional && glm::all(glm::greaterThan(index, glm::dvec3(-0.5))) &&
         glm::all(glm::lessThan(index, glm::dvec3(dims) - 0.5));
}

void AttenuationGrid::setOpenFaces(const Towards& towards, glm::ivec3 dims) {
  for (int axis = 0; axis < 3; ++axis) {
    openLow[axis] = towards.index[axis] < (towards.directional ? 0.0 : -0.5);
    openHigh[axis] = towards.index[axis] > (towards.directional ? 0.0 : dims[axis] - 0.5);
  }
}

}  // namespace freevoxel
