#include "splat/cell_block.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/glm.hpp>

#include "base/grid.h"

namespace freevoxel {

CellLayout cellLayout(const VisibleBlock& block, glm::ivec3 dims, int edge, int axis, bool lit) {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  const int side = blockSide(edge);
  const int strides[3] = {1, side, side * side};
  // Blocks at the border own what lies beyond it too, half a voxel of the finest level on each side.
  constexpr float kBeyond = 1e9f;
  const auto low = [&](int i) { return block.low[i] == 0 ? -kBeyond : float(block.low[i]); };
  const auto high = [&](int i) { return block.high[i] >= dims[i] ? kBeyond : float(block.high[i]); };
  CellLayout layout{};
  layout.originA = block.origin[axis];
  layout.originB = block.origin[b];
  layout.originC = block.origin[c];
  layout.strideA = strides[axis];
  layout.strideB = strides[b];
  layout.strideC = strides[c];
  layout.lowA = low(axis);
  layout.highA = high(axis);
  layout.lowB = low(b);
  layout.highB = high(b);
  layout.lowC = low(c);
  layout.highC = high(c);
  layout.lastB = float(dims[b] - 1);
  layout.lastC = float(dims[c] - 1);
  layout.voxels = float(1 << block.level);
  layout.perVoxel = 1.0f / layout.voxels;
  layout.offset = 0.5f - 0.5f * layout.perVoxel;
  layout.lit = lit ? 1 : 0;
  layout.matter = block.level == 0 ? -1 : 0;
  return layout;
}

PixelBounds pixelBounds(const VolumeView& view, const VisibleBlock& block) {
  // At the volume's border blocks reach half a voxel further out.
  const double voxels = double(1 << block.level);
  const glm::dvec3 low = glm::dvec3(block.low) * voxels - 0.5, high = glm::dvec3(block.high) * voxels + 0.5;
  glm::dvec2 lower(INFINITY), upper(-INFINITY);
  bool ahead = false;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p = view.viewPosition(
        {(corner & 1) ? high.x : low.x, (corner & 2) ? high.y : low.y, (corner & 4) ? high.z : low.z});
    glm::dvec2 pixel;
    if (view.orthographic) {
      ahead = ahead || p.z <= 0.0;
      pixel = view.centre + view.pixelsPerUnit * glm::dvec2(p.x, -p.y);
    } else {
      const double depth = -p.z;
      // A corner behind the eye's plane: the block may cover any pixel.
      if (depth < 1e-3) {
        lower = glm::dvec2(-INFINITY);
        upper = glm::dvec2(INFINITY);
        continue;
      }
      ahead = true;
      pixel = view.centre + view.pixelsPerUnit / depth * glm::dvec2(p.x, -p.y);
    }
    lower = glm::min(lower, pixel);
    upper = glm::max(upper, pixel);
  }
  PixelBounds bounds;
  if (!ahead) return bounds;
  for (int axis = 0; axis < 2; ++axis) {
    const double size = view.imageSize[axis];
    bounds.low[axis] = int(std::clamp(std::floor(lower[axis] - 0.5), 0.0, size));
    bounds.high[axis] = int(std::clamp(std::ceil(upper[axis] + 0.5), 0.0, size));
  }
  return bounds;
}

bool isHidden(const VisibleBlock& block, glm::ivec3 dims, int edge, const BlockSamples& samples, uint16_t threshold) {
  const glm::ivec3 low = block.low - 1, high = block.high + 2;
  if (glm::any(glm::lessThan(low, glm::ivec3(0))) || glm::any(glm::greaterThan(high, dims))) return false;
  const glm::ivec3 from = low - (block.origin - 1), size = high - low;
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      const uint16_t* row =
          samples.attenuations.data() + linearIndex(from + glm::ivec3(0, y, z), glm::ivec3(blockSide(edge)));
      for (int x = 0; x < size.x; ++x) {
        if (row[x] >= threshold) return false;
      }
    }
  }
  return true;
}

}  // namespace freevoxel
