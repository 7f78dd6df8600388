#include "splat/ready_blocks.h"

#include <algorithm>
#include <glm/common.hpp>

#include "base/first_exception.h"
#include "base/grid.h"
#include "volume/code_visibility.h"

namespace freevoxel {

namespace {

/// Bounds of what is visible, in cells counted from the corner of the apron.
struct CellBounds {
  glm::ivec3 low{INT32_MAX}, high{INT32_MIN};
  bool empty() const { return low.x >= high.x; }
  void add(glm::ivec3 cell) {
    low = glm::min(low, cell);
    high = glm::max(high, cell + 1);
  }
};

/// Smallest and largest code of the four voxels of each square of a plane.
void squareRanges(const uint16_t* plane, int side, std::vector<uint16_t>& low, std::vector<uint16_t>& high) {
  for (int y = 0; y + 1 < side; ++y) {
    const uint16_t* a = plane + size_t(y) * size_t(side);
    const uint16_t* b = a + side;
    uint16_t* lowRow = low.data() + size_t(y) * size_t(side);
    uint16_t* highRow = high.data() + size_t(y) * size_t(side);
    for (int x = 0; x + 1 < side; ++x) {
      lowRow[x] = std::min(std::min(a[x], a[x + 1]), std::min(b[x], b[x + 1]));
      highRow[x] = std::max(std::max(a[x], a[x + 1]), std::max(b[x], b[x + 1]));
    }
  }
}

CellBounds visibleCells(std::span<const uint16_t> codes, int side, const CodeVisibility& visibility) {
  const size_t planeVoxels = size_t(side) * size_t(side);
  std::vector<uint16_t> low(planeVoxels), high(planeVoxels), lowNext(planeVoxels), highNext(planeVoxels);
  CellBounds bounds;
  squareRanges(codes.data(), side, low, high);
  for (int z = 0; z + 1 < side; ++z) {
    squareRanges(codes.data() + size_t(z + 1) * planeVoxels, side, lowNext, highNext);
    for (int y = 0; y + 1 < side; ++y) {
      for (int x = 0; x + 1 < side; ++x) {
        const size_t i = size_t(y) * size_t(side) + size_t(x);
        if (visibility.between(std::min(low[i], lowNext[i]), std::max(high[i], highNext[i]))) bounds.add({x, y, z});
      }
    }
    low.swap(lowNext);
    high.swap(highNext);
  }
  return bounds;
}

CellBounds visibleCells(std::span<const shared::CoverValue> cover, int side) {
  CellBounds bounds;
  size_t i = 0;
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x, ++i) {
        if (cover[i].cover == 0.0f) continue;
        // A voxel is a corner of the cells on either side of it.
        bounds.add(glm::max(glm::ivec3(x, y, z) - 1, 0));
        bounds.add({x, y, z});
      }
    }
  }
  return bounds;
}

}  // namespace

bool shrinkToVisible(VisibleBlock& block, int edge, const BlockSamples& samples, const CodeVisibility& visibility) {
  const int side = blockSide(edge);
  CellBounds bounds =
      block.level == 0 ? visibleCells(samples.codes, side, visibility) : visibleCells(samples.cover, side);
  if (bounds.empty()) return false;
  // Cell n lies between voxels n and n + 1, and those of coarser levels less than half a voxel higher.
  bounds.low += block.origin - 1;
  bounds.high += block.origin - 1 + (block.level == 0 ? 0 : 1);
  block.low = glm::max(block.low, bounds.low);
  block.high = glm::min(block.high, bounds.high);
  return block.low.x < block.high.x && block.low.y < block.high.y && block.low.z < block.high.z;
}

std::vector<VisibleBlock> blocksOnImage(const CellFrame& frame, std::span<const VisibleBlock> blocks,
                                        CellCounts& counts) {
  std::vector<VisibleBlock> shown;
  for (const VisibleBlock& block : blocks) {
    if (!frame.everything && pixelBounds(*frame.view, block).empty()) {
      ++counts.culledBlocks;
    } else {
      shown.push_back(block);
    }
  }
  return shown;
}

void readyBlocks(const CellFrame& frame, std::span<const VisibleBlock> blocks, std::vector<ReadyBlock>& ready,
                 CellCounts& counts) {
  const auto hiddenBelow = uint16_t(frame.hiddenBlocksBelow * AttenuationGrid::kUnit);
  const int edge = frame.source->edge();
  frame.source->prepare(blocks);
  ready.resize(blocks.size());
  uint64_t empty = 0, hidden = 0, culled = 0;
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 1) reduction(+ : empty, hidden, culled)
  for (int64_t i = 0; i < int64_t(blocks.size()); ++i) {
    failure.guard([&] {
      ReadyBlock& one = ready[size_t(i)];
      one.block = blocks[size_t(i)];
      one.drawn = false;
      frame.source->gather(one.block, one.samples);
      if (frame.everything) {
        one.block.low = one.block.origin;
        one.block.high = one.block.origin + edge;
        one.bounds = {glm::ivec2(0), frame.view->imageSize};
        one.drawn = true;
        return;
      }
      if (!shrinkToVisible(one.block, edge, one.samples, *frame.visibility)) {
        ++empty;
        return;
      }
      if (hiddenBelow > 0 && isHidden(one.block, frame.source->dims(one.block.level), edge, one.samples, hiddenBelow)) {
        ++hidden;
        return;
      }
      one.bounds = pixelBounds(*frame.view, one.block);
      one.drawn = !one.bounds.empty();
      if (!one.drawn) ++culled;
    });
  }
  failure.rethrow();
  counts.emptyBlocks += empty;
  counts.hiddenBlocks += hidden;
  counts.culledBlocks += culled;
  for (const ReadyBlock& one : ready) {
    if (!one.drawn) continue;
    ++counts.blocks;
    const size_t level = size_t(one.block.level);
    if (counts.blocksOfLevel.size() <= level) counts.blocksOfLevel.resize(level + 1);
    ++counts.blocksOfLevel[level];
    const glm::ivec2 size = one.bounds.high - one.bounds.low;
    counts.fragments += uint64_t(size.x) * uint64_t(size.y);
  }
}

}  // namespace freevoxel
