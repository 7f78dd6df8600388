// How much of each lamp's light reaches each stored voxel.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/light.h"
#include "voxlink/buffers.h"

namespace freevoxel {

enum class Shadows {
  attenuation,  ///< FreeVoxel attenuation of the stored voxels: one sweep per lattice direction for all lamps together
  rays,         ///< a ray from every stored voxel to every lamp
  none,         ///< light passes everything
};

/// Shares of light, 255 = all of it: lamp after lamp, one byte per fragment each.
using LightShares = std::vector<uint8_t>;

/// From a voxel to a lamp, in index space (voxels) and in lengths (shortest voxel edges, world axes).
struct LampView {
  explicit LampView(const Placement& placement, const Light& light);
  bool directional;
  glm::dvec3 index;            ///< the lamp's place, or the direction towards it, of any length
  glm::dmat3 lengthFromIndex;  ///< columns: the voxel edges
  glm::dvec3 from(glm::dvec3 voxel) const { return directional ? index : index - voxel; }
};

/// What the voxels strictly between a voxel and the lamp let through, along a ray from its centre.
LightShares rayShares(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                      std::span<const Light> lights);

/// The same from attenuation along the lattice directions (papers/freevoxels Eq. 5, over the stored voxels), looked up
/// towards the lamp by interpolation in its octant triangle (DESIGN section 3). Same bytes for any thread count.
LightShares attenuationShares(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                              std::span<const Light> lights);

/// One or the other; all light for Shadows::none.
LightShares lightShares(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                        std::span<const Light> lights, Shadows shadows);

}  // namespace freevoxel
