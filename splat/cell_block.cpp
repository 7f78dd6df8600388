#include "splat/cell_block.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "base/error.h"

namespace freevoxel {

namespace {

/// Calls f(voxel of the volume's arrays, voxel of the block's array) for every voxel of the block and its apron.
template <class F>
void forEachVoxel(glm::ivec3 dims, glm::ivec3 origin, int edge, F&& f) {
  const int side = blockSide(edge);
  int columns[64];
  check(side <= 64, "a block's side fits the table of columns");
  for (int x = 0; x < side; ++x)
    columns[x] = std::clamp(origin.x - 1 + x, 0, dims.x - 1);
  size_t to = 0;
  for (int z = 0; z < side; ++z) {
    for (int y = 0; y < side; ++y) {
      const uint64_t row = linearIndex(
          {0, std::clamp(origin.y - 1 + y, 0, dims.y - 1), std::clamp(origin.z - 1 + z, 0, dims.z - 1)}, dims);
      for (int x = 0; x < side; ++x)
        f(row + uint64_t(columns[x]), to++);
    }
  }
}

}  // namespace

void gatherBlock(const ValueGrid& grid, const AttenuationGrid& attenuation, glm::ivec3 origin, int edge,
                 std::span<uint16_t> codes, std::span<uint16_t> attenuations) {
  checkEqual(codes.size(), blockVoxels(edge), "voxels of a block");
  checkEqual(attenuations.size(), blockVoxels(edge), "voxels of a block");
  forEachVoxel(grid.dims, origin, edge, [&](uint64_t from, size_t to) {
    codes[to] = grid.codes[from];
    attenuations[to] = attenuation.values[from];
  });
  // Beyond the volume, towards the eye, nothing is in the way.
  const int side = blockSide(edge);
  const auto openLayer = [&](int axis, int layer) {
    glm::ivec3 p;
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    p[axis] = layer;
    for (p[c] = 0; p[c] < side; ++p[c]) {
      for (p[b] = 0; p[b] < side; ++p[b])
        attenuations[linearIndex(p, glm::ivec3(side))] = uint16_t(AttenuationGrid::kUnit);
    }
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (attenuation.openLow[axis] && origin[axis] == 0) openLayer(axis, 0);
    for (int layer = grid.dims[axis] - origin[axis] + 1; attenuation.openHigh[axis] && layer < side; ++layer)
      openLayer(axis, layer);
  }
}

void gatherLight(const LightGrid& light, glm::ivec3 dims, glm::ivec3 origin, int edge, std::span<LightValue> lights) {
  checkEqual(lights.size(), blockVoxels(edge), "voxels of a block");
  forEachVoxel(dims, origin, edge, [&](uint64_t from, size_t to) { lights[to] = light.values[from]; });
}

CellLayout cellLayout(const VisibleBlock& block, glm::ivec3 dims, int edge, int axis, bool lit) {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  const int side = blockSide(edge);
  const int strides[3] = {1, side, side * side};
  CellLayout layout{};
  layout.originA = block.origin[axis];
  layout.originB = block.origin[b];
  layout.originC = block.origin[c];
  layout.strideA = strides[axis];
  layout.strideB = strides[b];
  layout.strideC = strides[c];
  // Blocks at the border own what lies beyond it too, half a voxel on each side.
  layout.firstA = block.low[axis] == 0 ? -1 : block.low[axis];
  layout.endA = std::min(block.high[axis], dims[axis]);
  layout.lastB = float(dims[b] - 1);
  layout.lastC = float(dims[c] - 1);
  constexpr float kBeyond = 1e9f;
  layout.ownLowB = block.origin[b] == 0 ? -kBeyond : float(block.origin[b]);
  layout.ownLowC = block.origin[c] == 0 ? -kBeyond : float(block.origin[c]);
  layout.ownHighB = block.origin[b] + edge >= dims[b] ? kBeyond : float(block.origin[b] + edge);
  layout.ownHighC = block.origin[c] + edge >= dims[c] ? kBeyond : float(block.origin[c] + edge);
  layout.lit = lit ? 1 : 0;
  return layout;
}

PixelBounds pixelBounds(const VolumeView& view, const VisibleBlock& block) {
  // Pieces of rays that the block owns begin inside these cells and end up to a cell beside them; at the volume's
  // border they start half a voxel further out.
  const glm::dvec3 low = glm::dvec3(block.low) - 1.0, high = glm::dvec3(block.high) + 1.0;
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

}  // namespace freevoxel
