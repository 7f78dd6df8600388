// Triangles.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "voxlink/material.h"

namespace freevoxel {

/// Triangles in world space. Invariant: positions are finite, every index is below the size of what it points into, and
/// no triangle has area 0.
struct Mesh {
  std::vector<glm::vec3> positions;          ///< of vertices, world
  std::vector<glm::vec3> normals;            ///< empty, or one per position: unit vectors, world, 0 where unknown
  std::vector<glm::uvec3> triangles;         ///< three vertices each, counter-clockwise seen from outside
  std::vector<uint32_t> materialOfTriangle;  ///< one per triangle
  std::vector<Material> materials;           ///< at least one if there are triangles
};

}  // namespace freevoxel
