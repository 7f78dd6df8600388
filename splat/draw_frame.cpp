#include "splat/draw_frame.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "base/error.h"
#include "base/first_exception.h"
#include "base/grid.h"
#include "gl/objects.h"
#include "splat/draw_cells.h"
#include "splat/draw_kernels.h"
#include "splat/kernel_splats.h"
#include "splat/ready_blocks.h"

namespace freevoxel {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Kernel splats held at a time: 48 bytes each.
constexpr size_t kSplatsPerBatch = size_t(1) << 20;

/// What less of its light than this would reach the eye from is hidden.
constexpr float kHiddenBelow = 0x1p-12f;

/// A small generator of our own: the standard's shuffle differs between libraries.
class SplitMix {
 public:
  explicit SplitMix(uint64_t seed) : state_(seed) {}
  uint64_t next() {
    uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }

 private:
  uint64_t state_;
};

template <class T>
void putInOrder(std::vector<T>& items, const SplatOrder& order, uint64_t salt) {
  if (order.kind == SplatOrder::Kind::reverse) std::reverse(items.begin(), items.end());
  if (order.kind == SplatOrder::Kind::shuffle) {
    SplitMix random(order.seed * 0x2545f4914f6cdd1du + salt);
    for (size_t i = items.size(); i > 1; --i)
      std::swap(items[i - 1], items[size_t(random.next() % i)]);
  }
}

void addAt(std::vector<uint64_t>& counts, size_t level, uint64_t count) {
  if (counts.size() <= level) counts.resize(level + 1);
  counts[level] += count;
}

uint64_t allowedGlBytes(const SplatOptions& options) {
  return options.gpuMemoryBytes > 0 ? options.gpuMemoryBytes : std::numeric_limits<uint64_t>::max();
}

/// Tiles of rays (kRayTile) in which one of the blocks may be seen, or all.
std::vector<uint8_t> coveredTiles(const VolumeView& view, std::span<const VisibleBlock> blocks, bool all) {
  const glm::ivec2 count = (view.imageSize + (kRayTile - 1)) / kRayTile;
  std::vector<uint8_t> covered(size_t(count.x) * size_t(count.y), all ? 1 : 0);
  for (const VisibleBlock& block : blocks) {
    const PixelBounds bounds = pixelBounds(view, block);
    if (bounds.empty()) continue;
    const glm::ivec2 first = bounds.low / kRayTile, last = (bounds.high - 1) / kRayTile;
    for (int y = first.y; y <= last.y; ++y)
      std::fill_n(covered.begin() + int64_t(y) * count.x + first.x, last.x - first.x + 1, uint8_t(1));
  }
  return covered;
}

CellFrame cellFrame(const FrameDrawing& frame, const std::vector<PixelRay>& rays, float quantum) {
  CellFrame cells;
  cells.source = frame.source;
  cells.table = frame.table;
  cells.view = frame.view;
  cells.rays = &rays;
  cells.visibility = frame.visibility;
  cells.inverseQuantum = 1.0f / quantum;
  cells.everything = frame.options->cull == Cull::off;
  const bool hidden = frame.options->cull == Cull::hidden;
  cells.hiddenBelow = hidden && frame.endRays ? kHiddenBelow : 0.0f;
  cells.hiddenBlocksBelow = hidden ? kHiddenBelow : 0.0f;
  return cells;
}

CellCanvas& cellCanvas(const FrameDrawing& frame) {
  KeptCanvas& kept = *frame.canvas;
  const uint64_t glBytes = frame.context != nullptr ? allowedGlBytes(*frame.options) : 0;
  if (kept.canvas && kept.imageSize == frame.camera->imageSize && kept.blocksAtATime == frame.blocksAtATime &&
      kept.glBytes == glBytes) {
    return *kept.canvas;
  }
  kept.canvas.reset();
  kept.imageSize = frame.camera->imageSize;
  kept.blocksAtATime = frame.blocksAtATime;
  kept.glBytes = glBytes;
  kept.canvas = frame.context != nullptr ? makeGlCellCanvas(*frame.context, kept.imageSize, kept.blocksAtATime, glBytes)
                                         : makeCpuCellCanvas(kept.imageSize, kept.blocksAtATime);
  return *kept.canvas;
}

Image drawCells(const FrameDrawing& frame, std::span<const VisibleBlock> blocks, float quantum,
                SplatStatistics& statistics, Progress& progress) {
  const Clock::time_point setupStart = Clock::now();
  CellCanvas& canvas = cellCanvas(frame);
  std::vector<PixelRay>& rays = *frame.rays;
  rays.resize(size_t(frame.camera->imageSize.x) * size_t(frame.camera->imageSize.y));
  pixelRays(*frame.placement, frame.source->dims(0), *frame.camera,
            coveredTiles(*frame.view, blocks, frame.options->cull == Cull::off), rays);
  CellFrame cells = cellFrame(frame, rays, quantum);
  cells.advanced = [&](size_t done) { progress.advance(done); };
  statistics.setupSeconds += secondsSince(setupStart);
  const Clock::time_point drawStart = Clock::now();
  CellCounts counts;
  Image sums;
  try {
    canvas.clear();
    canvas.draw(cells, blocks, counts);
    sums = canvas.wholeQuanta();
  } catch (...) {
    frame.canvas->canvas.reset();  // it may be half made
    throw;
  }
  statistics.blocks += counts.blocks;
  statistics.splats += counts.blocks;
  for (size_t level = 0; level < counts.blocksOfLevel.size(); ++level) {
    addAt(statistics.blocksOfLevel, level, counts.blocksOfLevel[level]);
    addAt(statistics.splatsOfLevel, level, counts.blocksOfLevel[level]);
  }
  statistics.culledBlocks += counts.culledBlocks;
  statistics.hiddenBlocks += counts.hiddenBlocks;
  statistics.emptyBlocks += counts.emptyBlocks;
  statistics.fragments += counts.fragments;
  statistics.pieces += counts.pieces;
  statistics.visiblePieces += counts.visiblePieces;
  statistics.drawSeconds += secondsSince(drawStart);
  return sums;
}

Image drawKernels(const FrameDrawing& frame, std::span<const VisibleBlock> blocks, float quantum,
                  SplatStatistics& statistics, Progress& progress) {
  const SplatOptions& options = *frame.options;
  frame.canvas->canvas.reset();
  const std::unique_ptr<KernelCanvas> canvas = frame.context != nullptr
                                                   ? makeGlKernelCanvas(*frame.context, frame.camera->imageSize)
                                                   : makeCpuKernelCanvas(frame.camera->imageSize);
  if (frame.context != nullptr && gl::liveBytes() > allowedGlBytes(options)) {
    throw MachineError(
        fmt::format("the picture takes {} bytes of graphics memory, {} are allowed; allow more, or make "
                    "it smaller",
                    gl::liveBytes(), allowedGlBytes(options)));
  }
  std::vector<KernelSetup> setups;
  int levels = 1;
  for (const VisibleBlock& block : blocks)
    levels = std::max(levels, block.level + 1);
  for (int level = 0; level < levels; ++level) {
    setups.emplace_back(ofLevel(*frame.view, level), *frame.classified,
                        options.formula == Formula::paper ? KernelEmission::opacity : KernelEmission::telescoping,
                        quantum, options.cull == Cull::hidden ? kHiddenBelow : 0.0f);
  }
  const std::vector<PixelRay> noRays;
  const CellFrame cells = cellFrame(frame, noRays, quantum);
  std::vector<KernelSplat> batch;
  const auto flush = [&] {
    const Clock::time_point start = Clock::now();
    canvas->draw(batch);
    statistics.splats += batch.size();
    batch.clear();
    statistics.drawSeconds += secondsSince(start);
  };
  canvas->clear();
  constexpr size_t kBlocksPerTask = 8;
  const size_t blocksAtATime = std::min(kBlocksPerTask, frame.blocksAtATime);
  std::vector<VisibleBlock> shown;
  for (const VisibleBlock& block : blocks) {
    if (setups[size_t(block.level)].mayTouchImage(block.origin, frame.source->edge())) {
      shown.push_back(block);
    } else {
      ++statistics.culledBlocks;
      progress.advance(1);
    }
  }
  for (size_t first = 0; first < shown.size(); first += blocksAtATime) {
    const Clock::time_point start = Clock::now();
    const size_t count = std::min(blocksAtATime, shown.size() - first);
    frame.source->prepare(std::span(shown).subspan(first, count));
    std::vector<KernelSplat> splats[kBlocksPerTask];
    KernelSetup::Counts counts[kBlocksPerTask];
    bool hidden[kBlocksPerTask] = {};
    FirstException failure;
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(count); ++i) {
      failure.guard([&] {
        const VisibleBlock& block = shown[first + size_t(i)];
        BlockSamples samples;
        frame.source->gather(block, samples);
        const glm::ivec3 dims = frame.source->dims(block.level);
        hidden[i] =
            cells.hiddenBlocksBelow > 0.0f && isHidden(block, dims, frame.source->edge(), samples,
                                                       uint16_t(cells.hiddenBlocksBelow * AttenuationGrid::kUnit));
        if (hidden[i]) return;
        setups[size_t(block.level)].append(samples, block, dims, frame.source->edge(), splats[i], counts[i]);
        putInOrder(splats[i], options.order, 1 + linearIndex(block.origin, dims));
      });
    }
    failure.rethrow();
    for (size_t i = 0; i < count; ++i) {
      const auto level = size_t(shown[first + i].level);
      if (hidden[i]) {
        ++statistics.hiddenBlocks;
      } else if (splats[i].empty() && counts[i].culledSplats + counts[i].hiddenSplats == 0) {
        ++statistics.emptyBlocks;
      } else {
        ++statistics.blocks;
        addAt(statistics.blocksOfLevel, level, 1);
      }
      statistics.culledSplats += counts[i].culledSplats;
      statistics.hiddenSplats += counts[i].hiddenSplats;
      statistics.fragments += counts[i].fragments;
      addAt(statistics.splatsOfLevel, level, splats[i].size());
      batch.insert(batch.end(), splats[i].begin(), splats[i].end());
    }
    statistics.setupSeconds += secondsSince(start);
    if (batch.size() >= kSplatsPerBatch) flush();
    progress.advance(count);
  }
  flush();
  return canvas->wholeQuanta();
}

}  // namespace

KeptCanvas::KeptCanvas() = default;
KeptCanvas::~KeptCanvas() = default;

Image drawBlocks(const FrameDrawing& frame, std::span<const VisibleBlock> blocks, float quantum,
                 SplatStatistics& statistics, Progress& progress) {
  std::vector<VisibleBlock> ordered(blocks.begin(), blocks.end());
  putInOrder(ordered, frame.options->order, 0);
  if (frame.context != nullptr) gl::resetPeakBytes();
  Image sums = frame.options->footprint == Footprint::cell ? drawCells(frame, ordered, quantum, statistics, progress)
                                                           : drawKernels(frame, ordered, quantum, statistics, progress);
  if (frame.context != nullptr) statistics.glBytes = std::max(statistics.glBytes, gl::peakBytes());
  return sums;
}

}  // namespace freevoxel
