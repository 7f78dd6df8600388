#include "splat/splat.h"

#include <algorithm>
#include <chrono>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <numeric>
#include <utility>
#include <vector>

#include "base/error.h"
#include "shaders/shared/quantum.h"
#include "splat/attenuation_grid.h"
#include "splat/draw_cells.h"
#include "splat/draw_kernels.h"
#include "splat/kernel_splats.h"

namespace freevoxel {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Edge of a block, voxels. Attenuation comes in where rays enter a block, so larger blocks are more accurate; smaller
/// ones are skipped, culled and shared among processes more finely (docs/fidelity.md has the figures).
constexpr int kBlockEdge = 32;
/// Kernel splats held at a time: 48 bytes each.
constexpr size_t kSplatsPerBatch = size_t(1) << 20;
constexpr size_t kBlocksPerBatch = 64;

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

std::vector<Classified> classifyCodes(const ValueCoding& coding, const TransferFunction& transfer) {
  std::vector<Classified> classified(size_t(coding.largest) + 1);
  for (size_t code = 0; code < classified.size(); ++code)
    classified[code] = transfer.at(coding.decode(double(code)));
  return classified;
}

bool inside(const ValueGrid& grid, const Towards& target) {
  return !target.directional && glm::all(glm::greaterThan(target.index, glm::dvec3(-0.5))) &&
         glm::all(glm::lessThan(target.index, glm::dvec3(grid.dims) - 0.5));
}

Towards towardsEye(const ValueGrid& grid, const Camera& camera) {
  return camera.orthographicHeight ? Towards::direction(grid.placement, camera.eye - camera.target)
                                   : Towards::point(grid.placement, camera.eye);
}

}  // namespace

struct Splatter::State {
  const ValueGrid& grid;
  const AttenuationFile* file;
  TransferFunction transfer;
  std::vector<Classified> classified;
  ClassificationTable table;
  std::vector<VisibleBlock> blocks;
  VisibleCubes cubes;
  std::unique_ptr<gl::Context> context;  // null: cpu
  LightGrid light;

  /// Swept or stored attenuation towards a target; `name` gets which.
  AttenuationGrid attenuationTowards(const Towards& target, AttenuationSource source, StoredLookup lookup,
                                     std::string& name) const;
  /// Draws all blocks once and gives the sums in whole quanta.
  Image drawCells(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                  const SplatOptions& options, float quantum, SplatStatistics& statistics, Progress& progress);
  Image drawKernels(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                    const SplatOptions& options, float quantum, SplatStatistics& statistics, Progress& progress);
};

Splatter::Splatter(const ValueGrid& grid, const AttenuationFile* file, const TransferFunction& transfer,
                   Backend backend)
    : state_(std::make_unique<State>(State{grid, file, transfer, {}, {}, {}, {}, nullptr, {}})) {
  if (file != nullptr && !sameOpacity(transfer, file->transfer())) {
    throw InputError(fmt::format(
        "{}: made with other opacities than the transfer function given; run precompute again with it", file->path()));
  }
  if (backend != Backend::cpu) {
    try {
      state_->context = std::make_unique<gl::Context>();
    } catch (const MachineError&) {
      if (backend == Backend::gl) throw;
    }
    // A GL that runs on the CPU is slower there than our own code.
    if (backend == Backend::automatic && state_->context && state_->context->isSoftware()) state_->context.reset();
  }
  state_->classified = classifyCodes(grid.coding, transfer);
  state_->table = classificationTable(transfer, grid.coding);
  state_->blocks = findVisibleBlocks(grid, transfer, kBlockEdge);
  state_->cubes = findVisibleCubes(grid, transfer);
}

Splatter::~Splatter() = default;
Splatter::Splatter(Splatter&& other) noexcept = default;

AttenuationGrid Splatter::State::attenuationTowards(const Towards& target, AttenuationSource source,
                                                    StoredLookup lookup, std::string& name) const {
  const bool nearest = lookup == StoredLookup::nearest;
  if (source == AttenuationSource::automatic) {
    // What is stored runs on to the outside, past a target inside the volume.
    source =
        file != nullptr && (nearest || !inside(grid, target)) ? AttenuationSource::stored : AttenuationSource::swept;
  }
  if (source == AttenuationSource::swept && !nearest) {
    name = "swept";
    return sweptAttenuation(grid, table, cubes, target);
  }
  if (file == nullptr) {
    throw InputError("stored attenuation needs an attenuation file; make one with freevoxel precompute");
  }
  name = "stored";
  return storedAttenuation(*file, target, lookup);
}

Image Splatter::State::drawCells(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                                 const SplatOptions& options, float quantum, SplatStatistics& statistics,
                                 Progress& progress) {
  const Clock::time_point setupStart = Clock::now();
  const std::unique_ptr<CellCanvas> canvas =
      context ? makeGlCellCanvas(*context, camera.imageSize) : makeCpuCellCanvas(camera.imageSize);
  const std::vector<PixelRay> rays = pixelRays(grid.placement, grid.dims, camera);
  CellFrame frame;
  frame.grid = &grid;
  frame.attenuation = &attenuation;
  frame.light = &light;
  frame.table = &table;
  frame.view = &view;
  frame.rays = &rays;
  frame.edge = kBlockEdge;
  frame.inverseQuantum = 1.0f / quantum;
  std::vector<VisibleBlock> ordered = blocks;
  putInOrder(ordered, options.order, 0);
  statistics.setupSeconds += secondsSince(setupStart);
  const Clock::time_point drawStart = Clock::now();
  CellCounts counts;
  canvas->clear();
  for (size_t first = 0; first < ordered.size(); first += kBlocksPerBatch) {
    const size_t count = std::min(kBlocksPerBatch, ordered.size() - first);
    canvas->draw(frame, std::span(ordered).subspan(first, count), counts);
    progress.advance(count);
  }
  Image sums = canvas->wholeQuanta();
  statistics.blocks = statistics.splats = counts.blocks;
  statistics.culledBlocks = counts.culledBlocks;
  statistics.fragments = counts.fragments;
  statistics.drawSeconds += secondsSince(drawStart);
  return sums;
}

Image Splatter::State::drawKernels(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                                   const SplatOptions& options, float quantum, SplatStatistics& statistics,
                                   Progress& progress) {
  const std::unique_ptr<KernelCanvas> canvas =
      context ? makeGlKernelCanvas(*context, camera.imageSize) : makeCpuKernelCanvas(camera.imageSize);
  const KernelSetup setup(view, classified, options.formula, quantum);
  statistics.blocks = statistics.culledBlocks = statistics.splats = statistics.culledSplats = statistics.fragments = 0;
  std::vector<VisibleBlock> ordered = blocks;
  putInOrder(ordered, options.order, 0);
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
  for (size_t first = 0; first < ordered.size(); first += kBlocksPerTask) {
    const Clock::time_point start = Clock::now();
    const size_t count = std::min(kBlocksPerTask, ordered.size() - first);
    std::vector<KernelSplat> splats[kBlocksPerTask];
    KernelSetup::Counts counts[kBlocksPerTask];
    bool drawn[kBlocksPerTask] = {};
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(count); ++i) {
      const VisibleBlock& block = ordered[first + size_t(i)];
      drawn[i] = setup.mayTouchImage(block.origin, kBlockEdge);
      if (!drawn[i]) continue;
      setup.append(grid, attenuation, light, block.origin, kBlockEdge, splats[i], counts[i]);
      putInOrder(splats[i], options.order, 1 + linearIndex(block.origin, grid.dims));
    }
    for (size_t i = 0; i < count; ++i) {
      (drawn[i] ? statistics.blocks : statistics.culledBlocks) += 1;
      statistics.culledSplats += counts[i].culledSplats;
      statistics.fragments += counts[i].fragments;
      batch.insert(batch.end(), splats[i].begin(), splats[i].end());
    }
    statistics.setupSeconds += secondsSince(start);
    if (batch.size() >= kSplatsPerBatch) flush();
    progress.advance(count);
  }
  flush();
  return canvas->wholeQuanta();
}

SplatResult Splatter::render(const Camera& camera, const SplatOptions& options, Progress& progress) {
  State& state = *state_;
  SplatResult result;
  SplatStatistics& statistics = result.statistics;
  statistics.backend = state.context ? "gl" : "cpu";
  if (state.context) statistics.glRenderer = state.context->renderer();
  const bool paper = options.formula == Formula::paper;
  if (paper && options.footprint != Footprint::kernel) {
    throw InputError("formula paper is defined for the kernel footprint; add --footprint kernel");
  }

  const VolumeView view = volumeView(state.grid.placement, camera);
  const Clock::time_point attenuationStart = Clock::now();
  const AttenuationGrid attenuation =
      state.attenuationTowards(towardsEye(state.grid, camera), options.attenuation,
                               paper ? StoredLookup::nearest : StoredLookup::interpolated, statistics.attenuation);
  statistics.attenuationSeconds = secondsSince(attenuationStart);
  const Clock::time_point lightStart = Clock::now();
  state.light = lightGrid(state.grid, options.lighting, camera, [&](const Light& light) {
    const Towards target = light.directional ? Towards::direction(state.grid.placement, light.world)
                                             : Towards::point(state.grid.placement, light.world);
    return state.attenuationTowards(target, options.lightAttenuation, StoredLookup::interpolated,
                                    statistics.lightAttenuation);
  });
  statistics.lightSeconds = secondsSince(lightStart);

  float quantum = options.firstQuantum;
  for (;; quantum *= 4.0f, ++statistics.passes) {
    progress.begin("splatting", state.blocks.size(), "blocks");
    result.sums.image = options.footprint == Footprint::cell
                            ? state.drawCells(camera, view, attenuation, options, quantum, statistics, progress)
                            : state.drawKernels(camera, view, attenuation, options, quantum, statistics, progress);
    progress.end();
    result.sums.quantum = quantum;
    result.sums.lightScale = state.light.scale;
    // Powers of two: exact.
    const float units[kSumChannels] = {
        quantum, quantum, quantum, quantum, shared::kDepthHighUnit, shared::kDepthLowUnit};
    std::vector<float>& values = result.sums.image.pixels;
    for (size_t i = 0; i < values.size(); ++i)
      values[i] *= units[i % kSumChannels];
    if (sumsAreExact(result.sums)) return result;
    if (quantum > 1.0f) {
      // Light can be rounded more coarsely, but optical depth has fixed units.
      throw InputError(
          "optical depth along a pixel is beyond 2^18, too opaque to be summed exactly; lower the opacities or raise "
          "referenceLength");
    }
  }
}

}  // namespace freevoxel
