#include "hierarchy/direction_lookup.h"

#include <cmath>
#include <glm/common.hpp>
#include <utility>

#include "shaders/shared/directions.h"

namespace freevoxel {

DirectionTriangle directionTriangle(glm::dvec3 u) {
  const glm::dvec3 size = glm::abs(u);
  DirectionTriangle triangle{{0, 1, 2}, {}};
  std::array<int, 3>& axis = triangle.axis;
  if (size[axis[0]] < size[axis[1]]) std::swap(axis[0], axis[1]);
  if (size[axis[1]] < size[axis[2]]) std::swap(axis[1], axis[2]);
  if (size[axis[0]] < size[axis[1]]) std::swap(axis[0], axis[1]);
  int step[3] = {0, 0, 0};
  for (size_t k = 0; k < 3; ++k) {
    step[axis[k]] = u[axis[k]] < 0.0 ? -1 : 1;
    triangle.index[k] = shared::directionIndex(step[0], step[1], step[2]);
  }
  return triangle;
}

std::array<float, 3> directionWeights(const DirectionTriangle& triangle, glm::dvec3 u) {
  const double a = std::abs(u[triangle.axis[0]]), b = std::abs(u[triangle.axis[1]]), c = std::abs(u[triangle.axis[2]]);
  return {float((a - b) / a), float((b - c) / a), float(c / a)};
}

}  // namespace freevoxel
