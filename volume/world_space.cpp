#include "volume/world_space.h"

#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

namespace {

glm::dvec3 signsOf(FileSpace space) {
  switch (space) {
    case FileSpace::lps:
      return {-1.0, -1.0, 1.0};
    case FileSpace::las:
      return {-1.0, 1.0, 1.0};
    case FileSpace::leftHanded:
      return {1.0, 1.0, -1.0};
    case FileSpace::ras:
    case FileSpace::unnamed:
      break;
  }
  return glm::dvec3(1.0);
}

}  // namespace

Placement placeInWorld(const glm::dmat3& edges, glm::dvec3 origin, FileSpace space, const std::string& where) {
  const glm::dvec3 signs = signsOf(space);
  const glm::dvec3 positiveZero(0.0);  // -0 + 0 is 0
  Placement placement;
  placement.origin = signs * origin + positiveZero;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = glm::length(edges[axis]);
    if (!(length > 0.0) || !std::isfinite(length)) {
      throw InputError(fmt::format("{}: expected a voxel edge of positive length for axis {}, found ({}, {}, {})",
                                   where, "xyz"[axis], edges[axis].x, edges[axis].y, edges[axis].z));
    }
    placement.spacing[axis] = length;
    placement.direction[axis] = signs * (edges[axis] / length) + positiveZero;
  }
  if (!(std::abs(glm::determinant(placement.direction)) > 1e-6)) {
    throw InputError(fmt::format("{}: expected three axes that do not lie in one plane", where));
  }
  return placement;
}

}  // namespace freevoxel
