#include "splat/refinement.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "splat/level_selection.h"

namespace freevoxel {

namespace {

/// Steps from a level to the next finer one, if `levels` have to be left behind in all.
size_t stepsFrom(size_t level, size_t levels) {
  if (levels == 1) return 8;
  return level == 1 ? 6 : level == 2 ? 3 : 1;
}

std::tuple<int, int, int, int> placeOf(const VisibleBlock& block) {
  return {block.level, block.origin.z, block.origin.y, block.origin.x};
}

/// Those first whose middle is nearest to the eye's plane; of equally near ones, along the curve.
void sortFromNear(std::vector<VisibleBlock>& blocks, int edge, const VolumeView& view) {
  std::vector<std::pair<double, size_t>> distances;
  for (const VisibleBlock& block : blocks) {
    const glm::dvec3 middle = (glm::dvec3(block.origin) + 0.5 * edge) * double(1 << block.level);
    distances.emplace_back(-view.viewPosition(middle).z, distances.size());
  }
  std::sort(distances.begin(), distances.end());
  std::vector<VisibleBlock> sorted;
  for (const auto& [distance, i] : distances)
    sorted.push_back(blocks[i]);
  blocks = std::move(sorted);
}

}  // namespace

Refinement refinementTo(std::span<const VisibleBlock> cut, std::span<const std::vector<VisibleBlock>> levels, int edge,
                        const VolumeView& view) {
  std::vector<std::tuple<int, int, int, int>> kept;
  for (const VisibleBlock& block : cut)
    kept.push_back(placeOf(block));
  std::sort(kept.begin(), kept.end());
  Refinement result{levels.back(), {}};
  std::vector<VisibleBlock> current = result.first;
  for (size_t level = levels.size() - 1; level > 0; --level) {
    std::vector<VisibleBlock> open;
    for (const VisibleBlock& block : current) {
      if (!std::binary_search(kept.begin(), kept.end(), placeOf(block))) open.push_back(block);
    }
    sortFromNear(open, edge, view);
    const BlockChildren children(levels[level - 1], edge);
    const size_t steps = std::min(stepsFrom(level, levels.size() - 1), open.size());
    current.clear();
    for (size_t n = 0; n < steps; ++n) {
      RefinementStep step;
      for (size_t i = open.size() * n / steps; i < open.size() * (n + 1) / steps; ++i) {
        step.removed.push_back(open[i]);
        for (const size_t child : children.of(open[i]))
          step.added.push_back(levels[level - 1][child]);
      }
      current.insert(current.end(), step.added.begin(), step.added.end());
      result.steps.push_back(std::move(step));
    }
  }
  return result;
}

}  // namespace freevoxel
