// How attenuation towards a direction is looked up among the 26 (DESIGN section 3).
#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace freevoxel {

/// Octant triangle of a direction in index space: its face, edge and corner direction.
struct DirectionTriangle {
  std::array<int, 3> axis;   ///< of the largest, middle and smallest component a >= b >= c
  std::array<int, 3> index;  ///< direction indices: face, edge, corner
  bool operator==(const DirectionTriangle& other) const { return index == other.index; }
};

/// `u` need not have unit length; zero components count as positive.
DirectionTriangle directionTriangle(glm::dvec3 u);

/// Weights (a - b, b - c, c) / a of the triangle's directions; they sum to 1. `u` must not be 0.
std::array<float, 3> directionWeights(const DirectionTriangle& triangle, glm::dvec3 u);

}  // namespace freevoxel
