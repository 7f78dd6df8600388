// What surfaces of meshes and spheres are made of.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>

namespace freevoxel {

/// Where the light comes from that a surface lets through, opacity aside (papers/voxlink section 5.2.1).
enum class MaterialKind : uint32_t {
  diffuse,  ///< from straight behind it
  mirror,   ///< all from the direction of reflection
  glass,    ///< `reflectance` of it from the direction of reflection, the rest from that of refraction
};

/// A surface shows `opacity` of its own lit colour; 1 - opacity is what it lets through. Lamps light the colour as they
/// light voxels (base/light.h), highlights included.
struct Material {
  std::string name;  ///< as the file or the scene has it, may be empty
  MaterialKind kind = MaterialKind::diffuse;
  glm::vec3 linear{0.8f};          ///< linear RGB, each 0..1
  float opacity = 1.0f;            ///< 0..1, each time a ray meets the surface
  float reflectance = 0.1f;        ///< 0..1, beta of the paper; of glass only
  float indexOfRefraction = 1.5f;  ///< 1..4, inside against outside; of glass only

  bool operator==(const Material&) const = default;
};

}  // namespace freevoxel
