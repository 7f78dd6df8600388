// How values change from voxel to voxel: what shading takes for surfaces.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include "splat/value_grid.h"

namespace freevoxel {

/// Change of code per voxel along each index axis: central differences, one-sided at the border.
glm::vec3 indexGradient(const ValueGrid& grid, glm::ivec3 voxel);

/// Takes index gradients to change of value per shortest voxel edge, as a share of the range of codes, in world axes.
glm::mat3 worldFromIndexGradient(const ValueGrid& grid);

}  // namespace freevoxel
