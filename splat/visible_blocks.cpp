#include "splat/visible_blocks.h"

#include <algorithm>
#include <glm/common.hpp>
#include <utility>

#include "precompute/hilbert.h"
#include "volume/code_visibility.h"

namespace freevoxel {

namespace {

struct CellRange {
  glm::ivec3 low{INT32_MAX}, high{INT32_MIN};
  uint64_t count = 0;
  bool empty() const { return low.x >= high.x; }
};

/// Bounds and number of the visible cells whose lower corner lies in the block.
CellRange visibleCells(const ValueGrid& grid, const CodeVisibility& visibility, glm::ivec3 origin, int edge) {
  CellRange range;
  const glm::ivec3 last = glm::min(origin + edge, grid.dims);
  for (int z = origin.z; z < last.z; ++z) {
    for (int y = origin.y; y < last.y; ++y) {
      const int y1 = std::min(y + 1, grid.dims.y - 1);
      const int z1 = std::min(z + 1, grid.dims.z - 1);
      const uint16_t* rows[4] = {grid.codes.data() + linearIndex({0, y, z}, grid.dims),
                                 grid.codes.data() + linearIndex({0, y1, z}, grid.dims),
                                 grid.codes.data() + linearIndex({0, y, z1}, grid.dims),
                                 grid.codes.data() + linearIndex({0, y1, z1}, grid.dims)};
      const auto low = [&](int x) { return std::min({rows[0][x], rows[1][x], rows[2][x], rows[3][x]}); };
      const auto high = [&](int x) { return std::max({rows[0][x], rows[1][x], rows[2][x], rows[3][x]}); };
      uint16_t lowHere = low(origin.x), highHere = high(origin.x);
      for (int x = origin.x; x < last.x; ++x) {
        const int x1 = std::min(x + 1, grid.dims.x - 1);
        const uint16_t lowNext = low(x1), highNext = high(x1);
        if (visibility.between(std::min(lowHere, lowNext), std::max(highHere, highNext))) {
          ++range.count;
          range.low = glm::min(range.low, glm::ivec3(x, y, z));
          range.high = glm::max(range.high, glm::ivec3(x, y, z) + 1);
        }
        lowHere = lowNext;
        highHere = highNext;
      }
    }
  }
  return range;
}

}  // namespace

std::vector<VisibleBlock> findVisibleBlocks(const ValueGrid& grid, const TransferFunction& transfer, int edge) {
  const CodeVisibility visibility(transfer, grid.coding);
  const glm::ivec3 blocks = (grid.dims + (edge - 1)) / edge;
  std::vector<CellRange> own(voxelCount(blocks));
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < blocks.z; ++z) {
    for (int y = 0; y < blocks.y; ++y) {
      for (int x = 0; x < blocks.x; ++x) {
        own[linearIndex({x, y, z}, blocks)] = visibleCells(grid, visibility, glm::ivec3(x, y, z) * edge, edge);
      }
    }
  }
  std::vector<std::pair<uint64_t, VisibleBlock>> found;
  const int order = hilbertOrder(blocks);
  for (int z = 0; z < blocks.z; ++z) {
    for (int y = 0; y < blocks.y; ++y) {
      for (int x = 0; x < blocks.x; ++x) {
        // One cell to spare on every side, for those who look at what lies between two voxels.
        const glm::ivec3 origin = glm::ivec3(x, y, z) * edge;
        CellRange range;
        for (int n = 0; n < 27; ++n) {
          const glm::ivec3 at = glm::ivec3(x, y, z) + glm::ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
          if (glm::clamp(at, glm::ivec3(0), blocks - 1) != at) continue;
          const CellRange& cells = own[linearIndex(at, blocks)];
          if (cells.empty()) continue;
          const glm::ivec3 low = glm::max(cells.low - 1, origin);
          const glm::ivec3 high = glm::min(cells.high + 1, origin + edge);
          if (low.x >= high.x || low.y >= high.y || low.z >= high.z) continue;
          range.low = glm::min(range.low, low);
          range.high = glm::max(range.high, high);
        }
        if (!range.empty())
          found.emplace_back(hilbertIndex({x, y, z}, order),
                             VisibleBlock{origin, range.low, range.high, 0, own[linearIndex({x, y, z}, blocks)].count});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<VisibleBlock> result;
  result.reserve(found.size());
  for (auto& [index, block] : found)
    result.push_back(block);
  return result;
}

}  // namespace freevoxel
