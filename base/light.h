// Lamps and how surfaces answer to them.
#pragma once

#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace freevoxel {

/// A lamp: far away in a direction, or at a point of world space. Light does not fade with distance.
struct Light {
  bool directional = false;
  glm::dvec3 world{0.0};   ///< a position, or, if directional, the direction towards the lamp, of any length but 0
  glm::vec3 linear{1.0f};  ///< linear RGB, each >= 0
};

enum class Shading {
  none,     ///< light scatters the same way everywhere
  lambert,  ///< by the angle between light and gradient, on the side that faces the eye
  phong,    ///< lambert, and a highlight in the colours of light and voxel
};

/// What lights a scene. Without lamps and with ambient 1 every voxel shines with its own colour.
struct Lighting {
  std::vector<Light> lights;
  float ambient = 1.0f;  ///< >= 0, reaches every voxel unhindered
  Shading shading = Shading::none;

  bool unlit() const { return lights.empty() && ambient == 1.0f; }
};

/// Throws InputError for colours or directions that make no sense.
void checkLighting(const Lighting& lighting);

/// Share of diffuse light in Phong shading, share and exponent of the highlight.
inline constexpr float kPhongHighlight = 0.35f;
inline constexpr float kPhongExponent = 24.0f;

/// Gradients of this share of the value range per shortest voxel edge count fully as surfaces; where values hardly
/// change there is no surface to shade, and light scatters the same way in all directions.
inline constexpr float kSurfaceGradient = 0.02f;

/// What shading knows of a place in the volume, whatever the lamp.
struct Surface {
  glm::vec3 normal{0.0f};  ///< unit vector, world, on the side that faces the eye; 0 where there is no surface
  float share = 0.0f;      ///< how much of a surface it is, 0..1
};

/// `gradient`: change of value per shortest voxel edge as a share of the value range, world axes; `towardsEye`: unit
/// vector, world.
Surface surfaceFacing(glm::vec3 gradient, glm::vec3 towardsEye);

/// How much of a lamp's light a place sends to the eye. `towardsLight`, `towardsEye`: unit vectors, world.
float shade(Shading shading, const Surface& surface, glm::vec3 towardsLight, glm::vec3 towardsEye);

/// The same of a unit normal and how much of a surface it is, 0..1; inline, for loops over voxels.
inline float shadeSurface(Shading shading, glm::vec3 normal, float surface, glm::vec3 towardsLight,
                          glm::vec3 towardsEye) {
  const float side = glm::dot(normal, towardsEye) < 0.0f ? -1.0f : 1.0f;
  const float cosine = std::max(0.0f, side * glm::dot(normal, towardsLight));
  float shaded = cosine;
  if (shading == Shading::phong && cosine > 0.0f) {
    const float along =
        std::max(0.0f, 2.0f * cosine * side * glm::dot(normal, towardsEye) - glm::dot(towardsLight, towardsEye));
    static_assert(kPhongExponent == 24.0f);
    const float along4 = along * along * along * along, along8 = along4 * along4;
    shaded += kPhongHighlight * (along8 * along8 * along8);
  }
  return 1.0f + surface * (shaded - 1.0f);
}

/// Largest value of `shade`.
float largestShade(Shading shading);

}  // namespace freevoxel
