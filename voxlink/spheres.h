// Spheres: particles, atoms.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "voxlink/material.h"

namespace freevoxel {

/// Spheres in world space; the first three arrays have one entry per sphere. Invariant: centres and radii are finite,
/// radii above 0, every index is below materials.size().
struct Spheres {
  std::vector<glm::vec3> centres;
  std::vector<float> radii;
  std::vector<uint32_t> materialOfSphere;
  std::vector<Material> materials;
};

}  // namespace freevoxel
