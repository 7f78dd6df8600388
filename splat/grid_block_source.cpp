#include "splat/grid_block_source.h"

#include <algorithm>

#include "base/error.h"
#include "base/grid.h"

namespace freevoxel {

namespace {

/// Calls f(voxel of the volume's arrays, voxel of the block's array) for every voxel of the block and its apron.
template <class F>
void forEachVoxel(glm::ivec3 dims, glm::ivec3 origin, int edge, F&& f) {
  const int side = blockSide(edge);
  int columns[blockSide(kLargestBlockEdge)];
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

void openApron(glm::bvec3 openLow, glm::bvec3 openHigh, glm::ivec3 dims, glm::ivec3 origin, int edge,
               std::span<uint16_t> attenuations) {
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
    if (openLow[axis] && origin[axis] == 0) openLayer(axis, 0);
    for (int layer = dims[axis] - origin[axis] + 1; openHigh[axis] && layer < side; ++layer)
      openLayer(axis, layer);
  }
}

glm::ivec3 GridBlockSource::dims(int level) const {
  checkEqual(level, 0, "level of a grid");
  return grid_.dims;
}

uint64_t GridBlockSource::volumeBytes() const {
  const uint64_t attenuations = attenuation_ != nullptr ? attenuation_->values.size() : 0;
  return grid_.codes.size() * sizeof(uint16_t) + attenuations * sizeof(uint16_t) +
         light_.values.size() * sizeof(LightValue);
}

void GridBlockSource::gather(const VisibleBlock& block, BlockSamples& samples) const {
  checkEqual(block.level, 0, "level of a grid");
  samples.matter.clear();
  samples.cover.clear();
  samples.codes.resize(blockVoxels(edge_));
  forEachVoxel(grid_.dims, block.origin, edge_,
               [&](uint64_t from, size_t to) { samples.codes[to] = grid_.codes[from]; });
  samples.attenuations.assign(blockVoxels(edge_), uint16_t(AttenuationGrid::kUnit));
  if (attenuation_ != nullptr) {
    forEachVoxel(grid_.dims, block.origin, edge_,
                 [&](uint64_t from, size_t to) { samples.attenuations[to] = attenuation_->values[from]; });
    openApron(attenuation_->openLow, attenuation_->openHigh, grid_.dims, block.origin, edge_, samples.attenuations);
  }
  samples.lights.resize(lit() ? blockVoxels(edge_) : 0);
  if (lit()) {
    forEachVoxel(grid_.dims, block.origin, edge_,
                 [&](uint64_t from, size_t to) { samples.lights[to] = light_.values[from]; });
  }
}

}  // namespace freevoxel
