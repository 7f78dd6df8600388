#include "splat/gradient.h"

#include <algorithm>
#include <glm/glm.hpp>

namespace freevoxel {

glm::vec3 indexGradient(const ValueGrid& grid, glm::ivec3 voxel) {
  glm::vec3 gradient(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 low = voxel, high = voxel;
    low[axis] = std::max(0, voxel[axis] - 1);
    high[axis] = std::min(grid.dims[axis] - 1, voxel[axis] + 1);
    if (low[axis] == high[axis]) continue;
    gradient[axis] =
        (float(grid.codes[linearIndex(high, grid.dims)]) - float(grid.codes[linearIndex(low, grid.dims)])) /
        float(high[axis] - low[axis]);
  }
  return gradient;
}

glm::mat3 worldFromIndexGradient(const ValueGrid& grid) {
  // A gradient is a covector: it goes with the transposed inverse of the axes.
  const glm::dmat3 covector = glm::transpose(glm::inverse(glm::dmat3(grid.placement.worldFromIndex())));
  return glm::mat3(covector * (grid.placement.unitLength() / grid.coding.largest));
}

}  // namespace freevoxel
