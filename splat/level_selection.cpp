#include "splat/level_selection.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <optional>
#include <utility>

#include "splat/cell_block.h"

namespace freevoxel {

namespace {

uint64_t placeOf(glm::ivec3 block) {
  constexpr int kBits = 21;  // what validDims leaves for an axis
  return uint64_t(block.x) | uint64_t(block.y) << kBits | uint64_t(block.z) << (2 * kBits);
}

}  // namespace

BlockChildren::BlockChildren(std::span<const VisibleBlock> finer, int edge) : edge_(edge) {
  for (size_t i = 0; i < finer.size(); ++i)
    numbers_.emplace_back(placeOf(finer[i].origin / edge), i);
  std::sort(numbers_.begin(), numbers_.end());
}

std::vector<size_t> BlockChildren::of(const VisibleBlock& block) const {
  std::vector<size_t> result;
  for (int n = 0; n < 8; ++n) {
    const uint64_t place = placeOf(block.origin / edge_ * 2 + glm::ivec3(n & 1, n >> 1 & 1, n >> 2));
    const auto found = std::lower_bound(numbers_.begin(), numbers_.end(), std::pair(place, size_t(0)));
    if (found != numbers_.end() && found->first == place) result.push_back(found->second);
  }
  return result;
}

double largestVoxel(const VisibleBlock& block, int edge, const VolumeView& view) {
  const double voxels = double(1 << block.level);
  double longest = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    longest = std::max(longest, glm::length(view.viewFromIndex[axis]));
  if (view.orthographic) return longest * voxels * view.pixelsPerUnit;
  const glm::dvec3 low = glm::dvec3(block.origin) * voxels, high = low + double(edge) * voxels;
  double nearest = INFINITY;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p = view.viewPosition(
        {(corner & 1) ? high.x : low.x, (corner & 2) ? high.y : low.y, (corner & 4) ? high.z : low.z});
    nearest = std::min(nearest, -p.z);
  }
  return nearest > 0.0 ? longest * voxels * view.pixelsPerUnit / nearest : INFINITY;
}

std::vector<VisibleBlock> selectBlocks(std::span<const std::vector<VisibleBlock>> levels, int edge,
                                       const VolumeView& view, double pixels) {
  std::vector<std::vector<uint8_t>> reached(levels.size());
  for (size_t level = 0; level < levels.size(); ++level)
    reached[level].assign(levels[level].size(), level + 1 == levels.size() ? 1 : 0);
  std::vector<VisibleBlock> cut;
  for (size_t level = levels.size(); level-- > 0;) {
    std::optional<BlockChildren> children;
    if (level > 0) children.emplace(levels[level - 1], edge);
    for (size_t i = 0; i < levels[level].size(); ++i) {
      if (reached[level][i] == 0) continue;
      const VisibleBlock& block = levels[level][i];
      const bool fine = level == 0 || largestVoxel(block, edge, view) <= pixels || pixelBounds(view, block).empty();
      if (fine) {
        cut.push_back(block);
      } else {
        for (const size_t child : children->of(block))
          reached[level - 1][child] = 1;
      }
    }
  }
  return cut;
}

}  // namespace freevoxel
