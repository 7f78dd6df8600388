#include "base/placement.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

double Placement::unitLength() const {
  return std::min({spacing.x, spacing.y, spacing.z});
}

glm::dmat4 Placement::worldFromIndex() const {
  glm::dmat4 matrix(1.0);
  for (int axis = 0; axis < 3; ++axis)
    matrix[axis] = glm::dvec4(direction[axis] * spacing[axis], 0.0);
  matrix[3] = glm::dvec4(origin, 1.0);
  return matrix;
}

void Placement::check() const {
  for (int axis = 0; axis < 3; ++axis) {
    freevoxel::check(std::isfinite(spacing[axis]) && spacing[axis] > 0.0, "spacing is positive and finite");
    freevoxel::check(std::isfinite(origin[axis]), "origin is finite");
  }
  freevoxel::check(std::abs(glm::determinant(direction)) > 1e-6, "direction is not singular");
}

Box worldBounds(const Placement& placement, glm::ivec3 dims) {
  const glm::dmat4 worldFromIndex = placement.worldFromIndex();
  Box box{glm::dvec3(INFINITY), glm::dvec3(-INFINITY)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index((corner & 1) ? dims.x - 0.5 : -0.5, (corner & 2) ? dims.y - 0.5 : -0.5,
                           (corner & 4) ? dims.z - 0.5 : -0.5);
    const glm::dvec3 world = glm::dvec3(worldFromIndex * glm::dvec4(index, 1.0));
    box.lower = glm::min(box.lower, world);
    box.upper = glm::max(box.upper, world);
  }
  return box;
}

}  // namespace freevoxel
