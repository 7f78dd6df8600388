#include "splat/splat.h"

#include <algorithm>
#include <chrono>
#include <glm/common.hpp>
#include <glm/matrix.hpp>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.h"
#include "shaders/shared/quantum.h"
#include "splat/attenuation_grid.h"
#include "splat/blend_kernels.h"
#include "splat/coarse_volume.h"
#include "splat/draw_cells.h"
#include "splat/draw_kernels.h"
#include "splat/kernel_splats.h"
#include "splat/near_field.h"
#include "splat/pinned_attenuation.h"
#include "splat/pixel_rays.h"

namespace freevoxel {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

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

/// What less of its light than this would reach the eye from is hidden.
constexpr float kHiddenBelow = 0x1p-12f;

/// Whether no voxel that the block's rays may touch has attenuation of `threshold` (of AttenuationGrid::kUnit) or more.
/// Never at the volume's border, where a ray sees what it enters first, whatever the voxels around say.
bool isHidden(const VisibleBlock& block, glm::ivec3 dims, const AttenuationGrid& attenuation, uint16_t threshold) {
  const glm::ivec3 low = block.low - 1, high = block.high + 2;
  if (glm::any(glm::lessThan(low, glm::ivec3(0))) || glm::any(glm::greaterThan(high, dims))) return false;
  for (int z = low.z; z < high.z; ++z) {
    for (int y = low.y; y < high.y; ++y) {
      const uint16_t* row = attenuation.values.data() + linearIndex({low.x, y, z}, dims);
      for (int x = 0; x < high.x - low.x; ++x) {
        if (row[x] >= threshold) return false;
      }
    }
  }
  return true;
}

/// Tiles of rays (kRayTile) in which one of the blocks may be seen.
std::vector<uint8_t> coveredTiles(const VolumeView& view, std::span<const VisibleBlock> blocks) {
  const glm::ivec2 count = (view.imageSize + (kRayTile - 1)) / kRayTile;
  std::vector<uint8_t> covered(size_t(count.x) * size_t(count.y));
  for (const VisibleBlock& block : blocks) {
    const PixelBounds bounds = pixelBounds(view, block);
    if (bounds.empty()) continue;
    const glm::ivec2 first = bounds.low / kRayTile, last = (bounds.high - 1) / kRayTile;
    for (int y = first.y; y <= last.y; ++y)
      std::fill_n(covered.begin() + int64_t(y) * count.x + first.x, last.x - first.x + 1, uint8_t(1));
  }
  return covered;
}

Towards towardsEye(const ValueGrid& grid, const Camera& camera) {
  return camera.orthographicHeight ? Towards::direction(grid.placement, camera.eye - camera.target)
                                   : Towards::point(grid.placement, camera.eye);
}

}  // namespace

std::string_view attenuationSourceName(AttenuationSource source) {
  switch (source) {
    case AttenuationSource::automatic:
      return "auto";
    case AttenuationSource::stored:
      return "stored";
    case AttenuationSource::corrected:
      return "corrected";
    case AttenuationSource::swept:
      return "swept";
    case AttenuationSource::pinned:
      return "pinned";
    case AttenuationSource::quotient:
      return "quotient";
  }
  throw InternalError("internal error: unknown source of attenuation");
}

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
  std::optional<CoarseVolume> coarse;  ///< made when first needed
  int blockEdge;

  /// What of a frame does not depend on the quantum, light apart.
  struct Frame {
    Camera camera;
    SplatOptions options;
    VolumeView view;
    AttenuationGrid attenuation;
    SplatStatistics statistics;
  };
  std::optional<Frame> frame;
  std::vector<PixelRay> rays;  ///< of the frame, where blocks were drawn

  /// The source that `automatic` stands for. Throws InputError if there is no file to take it from.
  AttenuationSource chosen(AttenuationSource source, const Towards& target, bool lamp) const;
  /// What kernels draw leaves out a voxel's own matter, so there the near field is not traced.
  AttenuationGrid attenuationTowards(const Towards& target, AttenuationSource source, Footprint footprint);
  void lightVoxels(const Camera& camera, const SplatOptions& options, SplatStatistics& statistics);
  /// Visible blocks, without hidden ones if asked for, in the order asked for.
  std::vector<VisibleBlock> blocksToDraw(const AttenuationGrid& attenuation, const SplatOptions& options,
                                         std::span<const uint8_t> share, SplatStatistics& statistics) const;
  /// Draws the share's blocks once and gives the sums in whole quanta.
  Image drawCells(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                  const SplatOptions& options, float quantum, std::span<const uint8_t> share,
                  SplatStatistics& statistics, Progress& progress);
  Image drawKernels(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                    const SplatOptions& options, float quantum, std::span<const uint8_t> share,
                    SplatStatistics& statistics, Progress& progress);
};

Splatter::Splatter(const ValueGrid& grid, const AttenuationFile* file, const TransferFunction& transfer,
                   Backend backend, int blockEdge)
    : state_(std::make_unique<State>(State{grid, file, transfer, {}, {}, {}, {}, nullptr, {}, {}, blockEdge, {}, {}})) {
  check(blockEdge >= 1 && blockEdge <= 61, "a block's edge is 1 to 61 voxels");
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
  state_->blocks = findVisibleBlocks(grid, transfer, blockEdge);
  state_->cubes = findVisibleCubes(grid, transfer);
}

Splatter::~Splatter() = default;
Splatter::Splatter(Splatter&& other) noexcept = default;

AttenuationSource Splatter::State::chosen(AttenuationSource source, const Towards& target, bool lamp) const {
  if (source == AttenuationSource::automatic) {
    if (file != nullptr && findPin(*file, target)) return AttenuationSource::pinned;
    // What is stored runs on to the outside, past a target inside the volume.
    if (file == nullptr || target.inside(grid.dims)) return AttenuationSource::swept;
    return lamp ? AttenuationSource::stored : AttenuationSource::corrected;
  }
  if (source != AttenuationSource::swept && file == nullptr) {
    throw InputError(fmt::format("{} attenuation needs an attenuation file; make one with freevoxel precompute",
                                 attenuationSourceName(source)));
  }
  if (source == AttenuationSource::pinned && !findPin(*file, target)) {
    throw InputError(fmt::format(
        "{}: has no pin for {}; of its {} pins freevoxel info tells where they are, and freevoxel precompute "
        "{} adds this one",
        file->path(), lamp ? "a lamp of the picture" : "the eye", file->pinned().pins().size(),
        target.directional ? "--pin-direction" : "--pin-light"));
  }
  return source;
}

AttenuationGrid Splatter::State::attenuationTowards(const Towards& target, AttenuationSource source,
                                                    Footprint footprint) {
  if (source == AttenuationSource::swept) return sweptAttenuation(grid, table, cubes, target);
  if (source == AttenuationSource::pinned) return pinnedAttenuation(*file, findPin(*file, target).value());
  AttenuationGrid result = storedAttenuation(
      *file, target, source == AttenuationSource::quotient ? StoredLookup::quotient : StoredLookup::interpolated);
  if (source == AttenuationSource::corrected) {
    if (!coarse) coarse.emplace(grid, classified);
    coarse->correct(target, result);
    if (footprint == Footprint::cell) result = withNearField(grid, table, cubes, target, kNearPlanes, result);
  }
  return result;
}

void Splatter::State::lightVoxels(const Camera& camera, const SplatOptions& options, SplatStatistics& statistics) {
  std::vector<LampAttenuation> lamps;
  checkLighting(options.lighting);
  for (const Light& lamp : options.lighting.lights) {
    const Towards target =
        lamp.directional ? Towards::direction(grid.placement, lamp.world) : Towards::point(grid.placement, lamp.world);
    const AttenuationSource source = chosen(options.lightAttenuation, target, true);
    LampAttenuation attenuation;
    if (source == AttenuationSource::stored || source == AttenuationSource::quotient) {
      attenuation.stored.emplace(
          *file, target, source == AttenuationSource::quotient ? StoredLookup::quotient : StoredLookup::interpolated);
    } else if (source == AttenuationSource::pinned) {
      attenuation.pin = findPin(*file, target);
    } else {
      attenuation.grid = attenuationTowards(target, source, options.footprint);
    }
    lamps.push_back(std::move(attenuation));
    statistics.lightAttenuation = attenuationSourceName(source);
  }
  light = lightGrid(grid, cubes, file, options.lighting, camera, lamps);
}

Image Splatter::State::drawCells(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                                 const SplatOptions& options, float quantum, std::span<const uint8_t> share,
                                 SplatStatistics& statistics, Progress& progress) {
  const Clock::time_point setupStart = Clock::now();
  const std::unique_ptr<CellCanvas> canvas =
      context ? makeGlCellCanvas(*context, camera.imageSize) : makeCpuCellCanvas(camera.imageSize);
  const std::vector<VisibleBlock> ordered = blocksToDraw(attenuation, options, share, statistics);
  rays.resize(size_t(camera.imageSize.x) * size_t(camera.imageSize.y));
  pixelRays(grid.placement, grid.dims, camera, coveredTiles(view, ordered), rays);
  CellFrame cells;
  cells.grid = &grid;
  cells.attenuation = &attenuation;
  cells.light = &light;
  cells.table = &table;
  cells.view = &view;
  cells.rays = &rays;
  cells.edge = blockEdge;
  cells.inverseQuantum = 1.0f / quantum;
  // Stored attenuation, corrected or not, is too rough to end a ray.
  const bool endRays =
      options.cull == Cull::hidden && (statistics.attenuation == attenuationSourceName(AttenuationSource::swept) ||
                                       statistics.attenuation == attenuationSourceName(AttenuationSource::pinned));
  cells.hiddenBelow = endRays ? kHiddenBelow : 0.0f;
  statistics.setupSeconds += secondsSince(setupStart);
  const Clock::time_point drawStart = Clock::now();
  CellCounts counts;
  canvas->clear();
  for (size_t first = 0; first < ordered.size(); first += kBlocksPerBatch) {
    const size_t count = std::min(kBlocksPerBatch, ordered.size() - first);
    canvas->draw(cells, std::span(ordered).subspan(first, count), counts);
    progress.advance(count);
  }
  Image sums = canvas->wholeQuanta();
  statistics.blocks = statistics.splats = counts.blocks;
  statistics.culledBlocks = counts.culledBlocks;
  statistics.fragments = counts.fragments;
  statistics.pieces = counts.pieces;
  statistics.drawSeconds += secondsSince(drawStart);
  return sums;
}

std::vector<VisibleBlock> Splatter::State::blocksToDraw(const AttenuationGrid& attenuation, const SplatOptions& options,
                                                        std::span<const uint8_t> share,
                                                        SplatStatistics& statistics) const {
  std::vector<VisibleBlock> drawn = blocks;
  if (!share.empty()) {
    checkEqual(share.size(), blocks.size(), "length of a share");
    drawn.clear();
    for (size_t i = 0; i < blocks.size(); ++i) {
      if (share[i] != 0) drawn.push_back(blocks[i]);
    }
  }
  const size_t shared = drawn.size();
  if (options.cull == Cull::hidden) {
    std::vector<uint8_t> hidden(shared);
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(shared); ++i)
      hidden[size_t(i)] =
          isHidden(drawn[size_t(i)], grid.dims, attenuation, uint16_t(kHiddenBelow * AttenuationGrid::kUnit)) ? 1 : 0;
    size_t kept = 0;
    for (size_t i = 0; i < shared; ++i) {
      if (hidden[i] == 0) drawn[kept++] = drawn[i];
    }
    drawn.resize(kept);
  }
  statistics.hiddenBlocks = shared - drawn.size();
  putInOrder(drawn, options.order, 0);
  return drawn;
}

Image Splatter::State::drawKernels(const Camera& camera, const VolumeView& view, const AttenuationGrid& attenuation,
                                   const SplatOptions& options, float quantum, std::span<const uint8_t> share,
                                   SplatStatistics& statistics, Progress& progress) {
  const std::unique_ptr<KernelCanvas> canvas =
      context ? makeGlKernelCanvas(*context, camera.imageSize) : makeCpuKernelCanvas(camera.imageSize);
  const KernelSetup setup(view, classified,
                          options.formula == Formula::paper ? KernelEmission::opacity : KernelEmission::telescoping,
                          quantum, options.cull == Cull::hidden ? kHiddenBelow : 0.0f);
  statistics.blocks = statistics.culledBlocks = statistics.splats = statistics.culledSplats = statistics.fragments = 0;
  statistics.hiddenSplats = 0;
  const std::vector<VisibleBlock> ordered = blocksToDraw(attenuation, options, share, statistics);
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
      drawn[i] = setup.mayTouchImage(block.origin, blockEdge);
      if (!drawn[i]) continue;
      setup.append(grid, attenuation, light, block.origin, blockEdge, splats[i], counts[i]);
      putInOrder(splats[i], options.order, 1 + linearIndex(block.origin, grid.dims));
    }
    for (size_t i = 0; i < count; ++i) {
      (drawn[i] ? statistics.blocks : statistics.culledBlocks) += 1;
      statistics.culledSplats += counts[i].culledSplats;
      statistics.hiddenSplats += counts[i].hiddenSplats;
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

std::span<const VisibleBlock> Splatter::blocks() const {
  return state_->blocks;
}

void Splatter::prepare(const Camera& camera, const SplatOptions& options) {
  State& state = *state_;
  SplatStatistics statistics;
  statistics.passes = 0;
  statistics.backend = state.context ? "gl" : "cpu";
  if (state.context) statistics.glRenderer = state.context->renderer();
  const bool paper = options.formula == Formula::paper;
  if (paper && options.footprint != Footprint::kernel) {
    throw InputError("formula paper is defined for the kernel footprint; add --footprint kernel");
  }

  const Clock::time_point attenuationStart = Clock::now();
  const Towards eye = towardsEye(state.grid, camera);
  // The paper looks up the nearest direction, wherever the eye is.
  AttenuationSource source = options.attenuation;
  if (paper && source == AttenuationSource::automatic) source = AttenuationSource::stored;
  if (paper && source != AttenuationSource::stored) {
    throw InputError("formula paper takes the nearest of the 26 stored directions; leave --attenuation out");
  }
  source = state.chosen(source, eye, false);
  statistics.attenuation = attenuationSourceName(source);
  state.frame.reset();
  AttenuationGrid attenuation = paper ? storedAttenuation(*state.file, eye, StoredLookup::nearest)
                                      : state.attenuationTowards(eye, source, options.footprint);
  statistics.attenuationSeconds = secondsSince(attenuationStart);
  const Clock::time_point lightStart = Clock::now();
  state.lightVoxels(camera, options, statistics);
  statistics.lightSeconds = secondsSince(lightStart);
  state.frame.emplace(State::Frame{camera, options, volumeView(state.grid.placement, camera), std::move(attenuation),
                                   std::move(statistics)});
}

Sums Splatter::draw(float quantum, std::span<const uint8_t> share, Progress& progress) {
  State& state = *state_;
  check(state.frame.has_value(), "a frame is prepared before it is drawn");
  auto& [camera, options, view, attenuation, statistics] = *state.frame;
  ++statistics.passes;
  Sums sums;
  progress.begin("splatting", state.blocks.size(), "blocks");
  sums.image = options.footprint == Footprint::cell
                   ? state.drawCells(camera, view, attenuation, options, quantum, share, statistics, progress)
                   : state.drawKernels(camera, view, attenuation, options, quantum, share, statistics, progress);
  progress.end();
  sums.quantum = quantum;
  sums.lightScale = state.light.scale;
  // Powers of two: exact.
  const float units[kSumChannels] = {quantum, quantum, quantum, quantum, shared::kDepthHighUnit, shared::kDepthLowUnit};
  std::vector<float>& values = sums.image.pixels;
#pragma omp parallel for schedule(static)
  for (int64_t i = 0; i < int64_t(values.size()); i += kSumChannels) {
    for (int c = 0; c < kSumChannels; ++c)
      values[size_t(i + c)] *= units[c];
  }
  return sums;
}

std::vector<BlockWork> Splatter::countWork(const Camera& camera) const {
  const VolumeView view = volumeView(state_->grid.placement, camera);
  std::vector<BlockWork> work;
  work.reserve(state_->blocks.size());
  for (const VisibleBlock& block : state_->blocks) {
    const PixelBounds bounds = pixelBounds(view, block);
    const glm::ivec2 size = bounds.empty() ? glm::ivec2(0) : bounds.high - bounds.low;
    work.push_back({bounds.empty() ? 0 : block.visibleCells, uint64_t(size.x) * uint64_t(size.y)});
  }
  return work;
}

const SplatStatistics& Splatter::statistics() const {
  check(state_->frame.has_value(), "a frame is prepared before its statistics are read");
  return state_->frame->statistics;
}

SplatResult Splatter::render(const Camera& camera, const SplatOptions& options, Progress& progress) {
  prepare(camera, options);
  float quantum = options.firstQuantum;
  for (;;) {
    Sums sums = draw(quantum, {}, progress);
    if (sumsAreExact(sums)) return {std::move(sums), statistics()};
    quantum = nextQuantum(quantum);
  }
}

BlendedResult Splatter::renderBlended(const Camera& camera, BlendKernel kernel, const SplatOptions& options,
                                      Progress& progress) {
  State& state = *state_;
  BlendedResult result;
  SplatStatistics& statistics = result.statistics;
  statistics.backend = "cpu";
  const VolumeView view = volumeView(state.grid.placement, camera);
  const Clock::time_point lightStart = Clock::now();
  state.lightVoxels(camera, options, statistics);
  statistics.lightSeconds = secondsSince(lightStart);
  const Clock::time_point setupStart = Clock::now();
  const KernelSetup setup(view, state.classified,
                          kernel == BlendKernel::gaussian ? KernelEmission::peak : KernelEmission::telescoping, 1.0f,
                          0.0f);
  std::vector<BlendSplat> splats;
  KernelSetup::Counts counts;
  for (const VisibleBlock& block : state.blocks) {
    if (!setup.mayTouchImage(block.origin, state.blockEdge)) {
      ++statistics.culledBlocks;
      continue;
    }
    ++statistics.blocks;
    setup.appendWithDistance(state.grid, state.light, block.origin, state.blockEdge, splats, counts);
  }
  statistics.splats = splats.size();
  statistics.culledSplats = counts.culledSplats;
  statistics.fragments = counts.fragments;
  statistics.setupSeconds = secondsSince(setupStart);
  const Clock::time_point drawStart = Clock::now();
  progress.begin("blending", 1, "pictures");
  result.image = blendKernels(std::move(splats), kernel, camera.imageSize);
  for (size_t i = 0; i < result.image.pixels.size(); ++i) {
    if (i % 4 != 3) result.image.pixels[i] *= state.light.scale;
  }
  progress.advance(1);
  progress.end();
  statistics.drawSeconds = secondsSince(drawStart);
  return result;
}

}  // namespace freevoxel
