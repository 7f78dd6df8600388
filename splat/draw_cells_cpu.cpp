#include <algorithm>
#include <utility>
#include <vector>

#include "shaders/shared/quantum.h"
#include "splat/draw_cells.h"

namespace freevoxel::shared {

/// How the shared code reads the block at hand.
struct BlockReader {
  const float* places;
  const float* attenuations;
  const LightValue* lights;
  const TableEntry* integral;
  const TableEntry* density;
};

inline float blockPlace(const BlockReader& block, int voxel) {
  return block.places[voxel];
}
inline float blockAttenuation(const BlockReader& block, int voxel) {
  return block.attenuations[voxel];
}
inline void blockLight(const BlockReader& block, int voxel, float& red, float& green, float& blue) {
  const LightValue& light = block.lights[voxel];
  red = float(light.red) * (1.0f / LightGrid::kUnit);
  green = float(light.green) * (1.0f / LightGrid::kUnit);
  blue = float(light.blue) * (1.0f / LightGrid::kUnit);
}
inline TableValue tableIntegral(const BlockReader& block, int entry) {
  const TableEntry& e = block.integral[entry];
  return {e.red, e.green, e.blue, e.extinction};
}
inline TableValue tableDensity(const BlockReader& block, int entry) {
  const TableEntry& e = block.density[entry];
  return {e.red, e.green, e.blue, e.extinction};
}

}  // namespace freevoxel::shared

#define BLOCK_ACCESS const BlockReader &block_,
#define BLOCK_HAND_ON block_,
#include "shaders/shared/cell_block.h"

namespace freevoxel {

namespace {

constexpr int kTile = 32;              // pixels an edge
constexpr size_t kBlocksAtATime = 64;  // their samples fit the last-level cache

class CpuCellCanvas final : public CellCanvas {
 public:
  explicit CpuCellCanvas(glm::ivec2 imageSize) : size_(imageSize) {}

  void clear() override { image_ = Image(size_, kSumChannels); }

  void draw(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) override {
    while (!blocks.empty()) {
      const std::span<const VisibleBlock> batch = blocks.first(std::min(blocks.size(), kBlocksAtATime));
      blocks = blocks.subspan(batch.size());
      drawBatch(frame, batch, counts);
    }
  }

  Image wholeQuanta() override { return std::move(image_); }

 private:
  struct Prepared {
    PixelBounds bounds;
    CellLayout layouts[3];  ///< by dominant axis
    std::vector<float> places, attenuations;
    std::vector<LightValue> lights;
    shared::BlockReader reader;
  };

  void prepare(const CellFrame& frame, const VisibleBlock& block, Prepared& prepared) {
    prepared.bounds = pixelBounds(*frame.view, block);
    if (prepared.bounds.empty()) return;
    const bool lit = !frame.light->empty();
    const glm::ivec3 dims = frame.grid->dims;
    for (int axis = 0; axis < 3; ++axis)
      prepared.layouts[axis] = cellLayout(block, dims, frame.edge, axis, lit);
    const size_t voxels = blockVoxels(frame.edge);
    std::vector<uint16_t> codes(voxels), attenuations(voxels);
    gatherBlock(*frame.grid, *frame.attenuation, block.origin, frame.edge, codes, attenuations);
    prepared.places.resize(voxels);
    prepared.attenuations.resize(voxels);
    for (size_t i = 0; i < voxels; ++i) {
      prepared.places[i] = float(codes[i]) * frame.table->entriesPerCode;
      prepared.attenuations[i] = float(attenuations[i]) * (1.0f / AttenuationGrid::kUnit);
    }
    if (lit) {
      prepared.lights.resize(voxels);
      gatherLight(*frame.light, dims, block.origin, frame.edge, prepared.lights);
    }
    prepared.reader = {prepared.places.data(), prepared.attenuations.data(), prepared.lights.data(),
                       frame.table->integral.data(), frame.table->density.data()};
  }

  void drawBatch(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) {
    prepared_.resize(blocks.size());
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(blocks.size()); ++i)
      prepare(frame, blocks[size_t(i)], prepared_[size_t(i)]);
    for (const Prepared& prepared : prepared_) {
      (prepared.bounds.empty() ? counts.culledBlocks : counts.blocks) += 1;
      const glm::ivec2 size = prepared.bounds.high - prepared.bounds.low;
      if (!prepared.bounds.empty()) counts.fragments += uint64_t(size.x) * uint64_t(size.y);
    }
    const glm::ivec2 tiles = (image_.size + (kTile - 1)) / kTile;
    uint64_t pieces = 0;
#pragma omp parallel for schedule(dynamic, 1) reduction(+ : pieces)
    for (int tile = 0; tile < tiles.x * tiles.y; ++tile) {
      const glm::ivec2 low = glm::ivec2(tile % tiles.x, tile / tiles.x) * kTile;
      const glm::ivec2 high = glm::min(low + kTile, image_.size);
      for (const Prepared& prepared : prepared_) {
        if (prepared.bounds.empty()) continue;
        const glm::ivec2 from = glm::max(low, prepared.bounds.low), to = glm::min(high, prepared.bounds.high);
        for (int y = from.y; y < to.y; ++y) {
          for (int x = from.x; x < to.x; ++x)
            pieces += drawPixel(frame, prepared, x, y);
        }
      }
    }
    counts.pieces += pieces;
  }

  /// Gives the number of pieces traced.
  uint64_t drawPixel(const CellFrame& frame, const Prepared& prepared, int x, int y) {
    const PixelRay& ray = (*frame.rays)[size_t(y) * size_t(image_.size.x) + size_t(x)];
    if (!(ray.sLow < ray.sHigh)) return 0;
    const shared::RaySums sums = shared::traceBlock(
        prepared.reader, ray, prepared.layouts[ray.axisAndSide & shared::kRayAxisMask], frame.hiddenBelow);
    float* pixel = image_.at(x, y);
    pixel[0] += shared::roundToWhole(sums.red * frame.inverseQuantum);
    pixel[1] += shared::roundToWhole(sums.green * frame.inverseQuantum);
    pixel[2] += shared::roundToWhole(sums.blue * frame.inverseQuantum);
    pixel[3] += shared::roundToWhole(sums.emission * frame.inverseQuantum);
    float high, low;
    shared::splitDepth(sums.depth * shared::kDepth64FromLog2, high, low);
    pixel[4] += high;
    pixel[5] += low;
    return uint64_t(sums.pieces);
  }

  glm::ivec2 size_;
  Image image_;
  std::vector<Prepared> prepared_;
};

}  // namespace

std::unique_ptr<CellCanvas> makeCpuCellCanvas(glm::ivec2 imageSize) {
  return std::make_unique<CpuCellCanvas>(imageSize);
}

}  // namespace freevoxel
