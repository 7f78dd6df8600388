// What a voxel of a coarser level is made of, and how that follows from the eight it stands for.
#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace freevoxel {

struct LevelMatter {
  glm::vec3 glow{0.0f};     ///< linear colour times extinction
  float extinction = 0.0f;  ///< natural, per shortest edge of the finest level
};

/// The matter that stands for eight voxels, or for those of them that exist: `children[x + 2 y + 4 z]`, null where
/// there is none. `edges`: of a child, in shortest edges of the finest level.
///
/// Extinction is -ln(mean transmittance of the columns) along the axis that lets least through, so that an opaque sheet
/// stays opaque however thin it is; a mean of extinctions would be more opaque still where only some columns are.
/// Colours count by opacity over the voxel's shortest way: opaque matter beneath covers what lies on it by no more than
/// what it fills.
LevelMatter reducedMatter(const std::array<const LevelMatter*, 8>& children, glm::vec3 edges);

}  // namespace freevoxel
