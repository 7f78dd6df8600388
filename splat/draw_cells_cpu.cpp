#include <algorithm>
#include <utility>
#include <vector>

#include "shaders/shared/quantum.h"
#include "splat/draw_cells.h"
#include "splat/ready_blocks.h"

namespace freevoxel::shared {

/// How the shared code reads the block at hand.
struct BlockReader {
  const float* places;
  const float* attenuations;
  const LightValue* lights;
  const CoverValue* cover;
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
inline CoverValue blockCover(const BlockReader& block, int voxel) {
  return block.cover[voxel];
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

constexpr int kTile = 32;  // pixels an edge

class CpuCellCanvas final : public CellCanvas {
 public:
  CpuCellCanvas(glm::ivec2 imageSize, size_t blocksAtATime) : size_(imageSize), blocksAtATime_(blocksAtATime) {}

  void clear() override { image_ = Image(size_, kSumChannels); }

  void draw(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) override {
    const std::vector<VisibleBlock> shown = blocksOnImage(frame, blocks, counts);
    frame.advanced(blocks.size() - shown.size());
    for (size_t first = 0; first < shown.size(); first += blocksAtATime_) {
      const auto batch = std::span(shown).subspan(first, std::min(blocksAtATime_, shown.size() - first));
      readyBlocks(frame, batch, ready_, counts);
      drawBatch(frame, counts);
      frame.advanced(batch.size());
    }
  }

  Image wholeQuanta() override { return std::move(image_); }

 private:
  struct Prepared {
    CellLayout layouts[3];  ///< by dominant axis
    std::vector<float> places, attenuations;
    shared::BlockReader reader;
  };

  static void prepare(const CellFrame& frame, const ReadyBlock& ready, Prepared& prepared) {
    const bool lit = frame.source->lit();
    const glm::ivec3 dims = frame.source->dims(ready.block.level);
    for (int axis = 0; axis < 3; ++axis)
      prepared.layouts[axis] = cellLayout(ready.block, dims, frame.source->edge(), axis, lit);
    const BlockSamples& samples = ready.samples;
    prepared.places.resize(samples.codes.size());
    for (size_t i = 0; i < samples.codes.size(); ++i)
      prepared.places[i] = float(samples.codes[i]) * frame.table->entriesPerCode;
    prepared.attenuations.resize(samples.attenuations.size());
    for (size_t i = 0; i < samples.attenuations.size(); ++i)
      prepared.attenuations[i] = float(samples.attenuations[i]) * (1.0f / AttenuationGrid::kUnit);
    prepared.reader = {prepared.places.data(), prepared.attenuations.data(), samples.lights.data(),
                       samples.cover.data(),   frame.table->integral.data(), frame.table->density.data()};
  }

  void drawBatch(const CellFrame& frame, CellCounts& counts) {
    prepared_.resize(ready_.size());
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(ready_.size()); ++i) {
      if (ready_[size_t(i)].drawn) prepare(frame, ready_[size_t(i)], prepared_[size_t(i)]);
    }
    const glm::ivec2 tiles = (image_.size + (kTile - 1)) / kTile;
    uint64_t pieces = 0, visible = 0;
#pragma omp parallel for schedule(dynamic, 1) reduction(+ : pieces, visible)
    for (int tile = 0; tile < tiles.x * tiles.y; ++tile) {
      const glm::ivec2 low = glm::ivec2(tile % tiles.x, tile / tiles.x) * kTile;
      const glm::ivec2 high = glm::min(low + kTile, image_.size);
      for (size_t i = 0; i < ready_.size(); ++i) {
        if (!ready_[i].drawn) continue;
        const glm::ivec2 from = glm::max(low, ready_[i].bounds.low), to = glm::min(high, ready_[i].bounds.high);
        for (int y = from.y; y < to.y; ++y) {
          for (int x = from.x; x < to.x; ++x)
            drawPixel(frame, prepared_[i], x, y, pieces, visible);
        }
      }
    }
    counts.pieces += pieces;
    counts.visiblePieces += visible;
  }

  /// Adds the numbers of pieces traced, and of those with something visible.
  void drawPixel(const CellFrame& frame, const Prepared& prepared, int x, int y, uint64_t& pieces, uint64_t& visible) {
    const PixelRay& ray = (*frame.rays)[size_t(y) * size_t(image_.size.x) + size_t(x)];
    if (!(ray.sLow < ray.sHigh)) return;
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
    pieces += uint64_t(sums.pieces);
    visible += uint64_t(sums.visiblePieces);
  }

  glm::ivec2 size_;
  Image image_;
  size_t blocksAtATime_;
  std::vector<ReadyBlock> ready_;
  std::vector<Prepared> prepared_;
};

}  // namespace

std::unique_ptr<CellCanvas> makeCpuCellCanvas(glm::ivec2 imageSize, size_t blocksAtATime) {
  return std::make_unique<CpuCellCanvas>(imageSize, blocksAtATime);
}

uint64_t cpuCanvasBytes(int edge) {
  // Codes and attenuation, also as floats; cover; light.
  return blockVoxels(edge) *
         (2 * sizeof(uint16_t) + 2 * sizeof(float) + sizeof(shared::CoverValue) + sizeof(LightValue));
}

}  // namespace freevoxel
