#include "splat/splat.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/grid.h"
#include "shaders/shared/quantum.h"
#include "splat/attenuation_grid.h"
#include "splat/blend_kernels.h"
#include "splat/coarse_volume.h"
#include "splat/draw_cells.h"
#include "splat/draw_frame.h"
#include "splat/file_block_source.h"
#include "splat/grid_block_source.h"
#include "splat/kernel_splats.h"
#include "splat/level_selection.h"
#include "splat/levelled_block_source.h"
#include "splat/near_field.h"
#include "splat/pinned_attenuation.h"
#include "splat/pixel_rays.h"
#include "splat/refinement.h"

namespace freevoxel {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<Classified> classifyCodes(const ValueCoding& coding, const TransferFunction& transfer) {
  std::vector<Classified> classified(size_t(coding.largest) + 1);
  for (size_t code = 0; code < classified.size(); ++code)
    classified[code] = transfer.at(coding.decode(double(code)));
  return classified;
}

Towards towardsEye(const Placement& placement, const Camera& camera) {
  return camera.orthographicHeight ? Towards::direction(placement, camera.eye - camera.target)
                                   : Towards::point(placement, camera.eye);
}

Towards towardsLamp(const Placement& placement, const Light& lamp) {
  return lamp.directional ? Towards::direction(placement, lamp.world) : Towards::point(placement, lamp.world);
}

/// What is stored is traced near voxels for cells; kernels leave out a voxel's own matter.
bool hasNearField(AttenuationSource source, Footprint footprint) {
  return source == AttenuationSource::stored && footprint == Footprint::cell;
}

StoredLookup lookupOf(AttenuationSource source) {
  return source == AttenuationSource::quotient ? StoredLookup::quotient : StoredLookup::interpolated;
}

}  // namespace

void SplatStatistics::addCounts(const SplatStatistics& other) {
  blocks += other.blocks;
  culledBlocks += other.culledBlocks;
  hiddenBlocks += other.hiddenBlocks;
  emptyBlocks += other.emptyBlocks;
  splats += other.splats;
  culledSplats += other.culledSplats;
  hiddenSplats += other.hiddenSplats;
  fragments += other.fragments;
  pieces += other.pieces;
  visiblePieces += other.visiblePieces;
  const auto addLevels = [](std::vector<uint64_t>& to, const std::vector<uint64_t>& from) {
    to.resize(std::max(to.size(), from.size()));
    for (size_t i = 0; i < from.size(); ++i)
      to[i] += from[i];
  };
  addLevels(blocksOfLevel, other.blocksOfLevel);
  addLevels(splatsOfLevel, other.splatsOfLevel);
}

std::string_view attenuationSourceName(AttenuationSource source) {
  switch (source) {
    case AttenuationSource::automatic:
      return "auto";
    case AttenuationSource::interpolated:
      return "interpolated";
    case AttenuationSource::stored:
      return "stored";
    case AttenuationSource::swept:
      return "swept";
    case AttenuationSource::pinned:
      return "pinned";
    case AttenuationSource::quotient:
      return "quotient";
  }
  throw InternalError("internal error: unknown source of attenuation");
}

/// That attenuation towards lamps, and bricks, may take between two frames, each.
constexpr uint64_t kKeptBytes = uint64_t(1) << 30;

struct Splatter::State {
  const AttenuationFile* file = nullptr;  ///< may be null
  const ValueGrid* given = nullptr;       ///< may be null if there is a file
  TransferFunction transfer;
  int blockEdge = kBlockEdge;
  glm::ivec3 dims{0};
  Placement placement;
  ValueCoding coding;
  std::vector<Classified> classified;
  ClassificationTable table;
  std::optional<CodeVisibility> visibility;
  std::unique_ptr<gl::Context> context;  ///< null: cpu
  KeptCanvas canvas;
  // Made when first needed.
  std::optional<ValueGrid> own;
  std::optional<VisibleCubes> cubes, nearCubes;
  std::optional<CoarseVolume> coarse;
  std::optional<AbsentBricks> absent;             ///< bricks that the file lacks
  HeldBricks bricks;                              ///< what of the file is in memory
  std::vector<std::vector<VisibleBlock>> levels;  ///< blocks of each level; at first of the finest only

  /// What of a frame does not depend on the quantum.
  struct Frame {
    Camera camera;
    SplatOptions options;
    VolumeView view;
    bool allLevels = false;
    std::vector<VisibleBlock> blocks;
    size_t blocksAtATime = 64;
    // What the source looks at.
    AttenuationGrid attenuation;
    LightGrid light;
    std::optional<VoxelLighting> lighting;
    std::vector<std::shared_ptr<const AttenuationGrid>>
        lampGrids;  ///< per lamp; null where it is looked up in the file
    std::vector<std::unique_ptr<CoarseRatio>> ratios;
    std::unique_ptr<BlockSource> source;
    float lightScale = 1.0f;
    std::vector<PixelRay> rays;  ///< where blocks were drawn
    SplatStatistics statistics;
  };
  std::unique_ptr<Frame> frame;

  /// Attenuation towards a lamp, which stays while the lamp does: pictures of a turntable share it.
  struct KeptLamp {
    Towards target;
    AttenuationSource source;
    Footprint footprint;
    std::shared_ptr<const AttenuationGrid> grid;
    uint64_t lastUsed = 0;  ///< frame
  };
  std::vector<KeptLamp> keptLamps;
  uint64_t frameNumber = 0;

  void open(Backend backend);
  const ValueGrid& grid();
  const VisibleCubes& visibleCubes();
  const CoarseVolume& coarseVolume();
  void findLevels();
  /// The source that `automatic` stands for. Throws InputError if there is no file to take it from.
  AttenuationSource chosen(AttenuationSource source, const Towards& target, bool lamp) const;
  /// What kernels draw leaves out a voxel's own matter, so there the near field is not traced.
  AttenuationGrid attenuationTowards(const Towards& target, AttenuationSource source, Footprint footprint);
  std::shared_ptr<const AttenuationGrid> lampGrid(const Towards& target, AttenuationSource source, Footprint footprint);
  /// Forgets those that were not used for the longest time, down to so many bytes.
  void forgetLamps(uint64_t bytesLeft);
  StoredTarget storedTarget(Frame& to, const Towards& target, AttenuationSource source, bool nearest);
  void lookIntoGrids(Frame& to, const Towards& eye, AttenuationSource source);
  void lookIntoFile(Frame& to, const Towards& eye, AttenuationSource source);
  /// Bytes of a frame's arrays of the whole volume, and of the picture.
  uint64_t gridBytes(const SplatOptions& options, AttenuationSource source) const;
  static uint64_t pictureBytes(const Camera& camera);
  /// Throws MachineError if that is too little.
  void shareMemory(Frame& to, uint64_t fixedBytes, uint64_t bytesPerBlock, uint64_t& sourceBytes) const;
  LightGrid lightVoxels(const Camera& camera, const SplatOptions& options, SplatStatistics& statistics);
};

Splatter::Splatter(const ValueGrid& grid, const AttenuationFile* file, const TransferFunction& transfer,
                   Backend backend, int blockEdge)
    : state_(std::make_unique<State>()) {
  state_->file = file;
  state_->given = &grid;
  state_->transfer = transfer;
  state_->blockEdge = blockEdge;
  state_->dims = grid.dims;
  state_->placement = grid.placement;
  state_->coding = grid.coding;
  state_->open(backend);
}

Splatter::Splatter(const AttenuationFile& file, const TransferFunction& transfer, Backend backend, int blockEdge)
    : state_(std::make_unique<State>()) {
  state_->file = &file;
  state_->transfer = transfer;
  state_->blockEdge = blockEdge;
  state_->dims = file.dims();
  state_->placement = file.placement();
  state_->coding = file.coding();
  state_->open(backend);
}

Splatter::~Splatter() = default;
Splatter::Splatter(Splatter&& other) noexcept = default;

void Splatter::State::open(Backend backend) {
  check(blockEdge >= 1 && blockEdge <= kLargestBlockEdge, "a block's edge is in range");
  if (file != nullptr && !sameOpacity(transfer, file->transfer())) {
    throw InputError(fmt::format(
        "{}: made with other opacities than the transfer function given; run precompute again with it", file->path()));
  }
  if (backend != Backend::cpu) {
    try {
      context = std::make_unique<gl::Context>();
    } catch (const MachineError&) {
      if (backend == Backend::gl) throw;
    }
    // A GL that runs on the CPU is slower there than our own code.
    if (backend == Backend::automatic && context && context->isSoftware()) context.reset();
  }
  classified = classifyCodes(coding, transfer);
  table = classificationTable(transfer, coding);
  visibility.emplace(transfer, coding);
  levels.push_back(given != nullptr ? findVisibleBlocks(*given, transfer, blockEdge)
                                    : FileBlockSource::storedBlocks(*file, 0, blockEdge));
}

const ValueGrid& Splatter::State::grid() {
  if (given != nullptr) return *given;
  if (!own) own = valueGrid(*file);
  return *own;
}

const VisibleCubes& Splatter::State::visibleCubes() {
  if (!cubes) cubes = findVisibleCubes(grid(), transfer);
  return *cubes;
}

const CoarseVolume& Splatter::State::coarseVolume() {
  if (!coarse) coarse.emplace(*file, classified);
  return *coarse;
}

void Splatter::State::findLevels() {
  for (int level = int(levels.size()); level < file->levels(); ++level)
    levels.push_back(FileBlockSource::storedBlocks(*file, level, blockEdge));
}

AttenuationSource Splatter::State::chosen(AttenuationSource source, const Towards& target, bool lamp) const {
  if (source == AttenuationSource::automatic) {
    if (file != nullptr && findPin(*file, target)) return AttenuationSource::pinned;
    // What is stored runs on to the outside, past a target inside the volume.
    if (file == nullptr || target.inside(dims)) return AttenuationSource::swept;
    return AttenuationSource::stored;
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
  if (source == AttenuationSource::swept) return sweptAttenuation(grid(), table, visibleCubes(), target);
  if (source == AttenuationSource::pinned) return pinnedAttenuation(*file, findPin(*file, target).value());
  AttenuationGrid result = storedAttenuation(*file, target, lookupOf(source));
  if (source == AttenuationSource::stored) {
    coarseVolume().correct(target, result);
    if (hasNearField(source, footprint)) {
      if (!nearCubes) nearCubes = findNearCubes(grid(), *visibility);
      result = withNearField(grid(), table, *nearCubes, target, kNearPlanes, result);
    }
  }
  return result;
}

std::shared_ptr<const AttenuationGrid> Splatter::State::lampGrid(const Towards& target, AttenuationSource source,
                                                                 Footprint footprint) {
  for (KeptLamp& kept : keptLamps) {
    if (kept.target != target || kept.source != source || kept.footprint != footprint) continue;
    kept.lastUsed = frameNumber;
    return kept.grid;
  }
  auto grid = std::make_shared<const AttenuationGrid>(attenuationTowards(target, source, footprint));
  keptLamps.push_back({target, source, footprint, grid, frameNumber});
  return grid;
}

void Splatter::State::forgetLamps(uint64_t bytesLeft) {
  std::sort(keptLamps.begin(), keptLamps.end(),
            [](const KeptLamp& a, const KeptLamp& b) { return a.lastUsed > b.lastUsed; });
  const uint64_t each = voxelCount(dims) * sizeof(uint16_t);
  if (keptLamps.size() > bytesLeft / each) keptLamps.resize(size_t(bytesLeft / each));
}

LightGrid Splatter::State::lightVoxels(const Camera& camera, const SplatOptions& options, SplatStatistics& statistics) {
  std::vector<LampAttenuation> lamps;
  checkLighting(options.lighting);
  for (const Light& lamp : options.lighting.lights) {
    const Towards target = towardsLamp(placement, lamp);
    const AttenuationSource source = chosen(options.lightAttenuation, target, true);
    LampAttenuation attenuation;
    if (source == AttenuationSource::interpolated || source == AttenuationSource::quotient) {
      attenuation.stored.emplace(*file, target, lookupOf(source));
    } else if (source == AttenuationSource::pinned) {
      attenuation.pin = findPin(*file, target);
    } else {
      attenuation.grid = lampGrid(target, source, options.footprint);
    }
    lamps.push_back(std::move(attenuation));
    statistics.lightAttenuation = attenuationSourceName(source);
  }
  return lightGrid(grid(), visibleCubes(), file, options.lighting, camera, lamps);
}

uint64_t Splatter::State::gridBytes(const SplatOptions& options, AttenuationSource source) const {
  // Codes, attenuation towards the eye; light, and attenuation towards lamps that have it for the whole volume.
  uint64_t perVoxel = 2 * sizeof(uint16_t);
  uint64_t ratios = source == AttenuationSource::stored ? 1 : 0;
  bool nearField = hasNearField(source, options.footprint);
  if (!options.lighting.unlit()) perVoxel += sizeof(LightValue);
  for (const Light& lamp : options.lighting.lights) {
    const AttenuationSource ofLamp = chosen(options.lightAttenuation, towardsLamp(placement, lamp), true);
    if (ofLamp == AttenuationSource::stored || ofLamp == AttenuationSource::swept) perVoxel += sizeof(uint16_t);
    if (ofLamp == AttenuationSource::stored) ++ratios;
    nearField = nearField || hasNearField(ofLamp, options.footprint);
  }
  // The near field of one is made beside what it is made from.
  if (nearField) perVoxel += sizeof(uint16_t);
  return voxelCount(dims) * perVoxel + (ratios > 0 ? CoarseVolume::bytesFor(dims) : 0);
}

uint64_t Splatter::State::pictureBytes(const Camera& camera) {
  const uint64_t pixels = uint64_t(camera.imageSize.x) * uint64_t(camera.imageSize.y);
  // Rays, and sums as they are drawn, read back and resolved.
  return pixels * (sizeof(PixelRay) + 4 * kSumChannels * sizeof(float));
}

void Splatter::State::shareMemory(Frame& to, uint64_t fixedBytes, uint64_t bytesPerBlock, uint64_t& sourceBytes) const {
  const uint64_t allowed = to.options.memoryBytes;
  sourceBytes = UINT64_MAX;
  if (allowed == 0) return;
  fixedBytes += pictureBytes(to.camera);
  const uint64_t perBlock = bytesPerBlock + cpuCanvasBytes(blockEdge);
  if (allowed < fixedBytes + perBlock) {
    throw MachineError(
        fmt::format("this picture needs {} bytes of memory beside the program, {} are left for it; allow more, make it "
                    "smaller, or take --attenuation interpolated, which needs least",
                    fixedBytes + perBlock, allowed));
  }
  const uint64_t rest = allowed - fixedBytes;
  to.blocksAtATime = size_t(std::clamp<uint64_t>(rest / 2 / perBlock, 1, to.blocksAtATime));
  sourceBytes = rest - to.blocksAtATime * cpuCanvasBytes(blockEdge);
}

void Splatter::State::lookIntoGrids(Frame& to, const Towards& eye, AttenuationSource source) {
  if (to.options.lodPixels > 0.0 || (to.allLevels && source != AttenuationSource::stored)) {
    throw InputError(
        "swept and pinned attenuation know the finest level only; leave --lod out, or take --attenuation stored or "
        "interpolated");
  }
  uint64_t sourceBytes = 0;
  shareMemory(to, gridBytes(to.options, source), 0, sourceBytes);
  to.attenuation = attenuationTowards(eye, source, to.options.footprint);
  const Clock::time_point lightStart = Clock::now();
  to.light = lightVoxels(to.camera, to.options, to.statistics);
  to.lightScale = to.light.scale;
  to.statistics.lightSeconds = secondsSince(lightStart);
  to.source = std::make_unique<GridBlockSource>(grid(), &to.attenuation, to.light, blockEdge);
  to.blocks = levels[0];
}

StoredTarget Splatter::State::storedTarget(Frame& to, const Towards& target, AttenuationSource source, bool nearest) {
  StoredTarget result{target, nearest ? StoredLookup::nearest : lookupOf(source), nullptr};
  if (source == AttenuationSource::stored) {
    to.ratios.push_back(std::make_unique<CoarseRatio>(coarseVolume().ratio(target)));
    result.ratio = to.ratios.back().get();
    result.nearField = hasNearField(source, to.options.footprint);
  }
  return result;
}

void Splatter::State::lookIntoFile(Frame& to, const Towards& eye, AttenuationSource source) {
  const SplatOptions& options = to.options;
  FileBlockSource::View look;
  look.cells = options.footprint == Footprint::cell;
  look.table = &table;
  look.visibility = &*visibility;
  look.white = std::all_of(transfer.points.begin(), transfer.points.end(),
                           [](const TransferPoint& point) { return point.srgb == glm::dvec3(1.0); });
  if ((options.lodPixels > 0.0 || to.allLevels) && file->levels() > 1 && !look.white &&
      !sameColours(transfer, file->transfer())) {
    throw InputError(fmt::format(
        "{}: levels hold colours, those of its own transfer function; leave --lod out, or run precompute again",
        file->path()));
  }
  look.eye = storedTarget(to, eye, source, options.formula == Formula::paper);
  const Clock::time_point lightStart = Clock::now();
  checkLighting(options.lighting);
  uint64_t fixedBytes = 0;
  if (!options.lighting.unlit()) {
    to.lighting.emplace(placement, options.lighting, to.camera);
    to.lightScale = to.lighting->scale();
    look.lighting = &*to.lighting;
    to.lampGrids.resize(options.lighting.lights.size());
    for (size_t i = 0; i < to.lampGrids.size(); ++i) {
      const Towards target = towardsLamp(placement, options.lighting.lights[i]);
      const AttenuationSource ofLamp = chosen(options.lightAttenuation, target, true);
      to.statistics.lightAttenuation = attenuationSourceName(ofLamp);
      LampSource lamp;
      // What is pinned or swept is of the whole volume. What is stored may be: it then serves later frames too.
      const bool kept = options.lodPixels == 0.0 && options.memoryBytes == 0 && !options.blockwise && !to.allLevels &&
                        hasNearField(ofLamp, options.footprint);
      if (ofLamp == AttenuationSource::swept || ofLamp == AttenuationSource::pinned || kept) {
        to.lampGrids[i] = lampGrid(target, ofLamp, options.footprint);
        lamp.swept = to.lampGrids[i].get();
        fixedBytes += voxelCount(dims) * sizeof(uint16_t);
      } else {
        lamp.stored = storedTarget(to, target, ofLamp, false);
      }
      look.lamps.push_back(lamp);
    }
  }
  to.statistics.lightSeconds = secondsSince(lightStart);
  if (coarse) fixedBytes += CoarseVolume::bytesFor(dims);
  if (own) fixedBytes += voxelCount(dims) * sizeof(uint16_t);
  for (const auto& ratio : to.ratios)
    fixedBytes += ratio->bytes();
  uint64_t sourceBytes = 0;
  shareMemory(to, fixedBytes, FileBlockSource::bytesPerBlock(blockEdge, file->brickEdge(), look), sourceBytes);
  to.source = std::make_unique<FileBlockSource>(*file, std::move(look), absent, bricks, blockEdge, sourceBytes);
  if (options.lodPixels > 0.0) {
    findLevels();
    to.blocks = selectBlocks(levels, blockEdge, to.view, options.lodPixels);
  } else {
    to.blocks = levels[0];
  }
}

std::span<const VisibleBlock> Splatter::blocks() const {
  return state_->frame ? state_->frame->blocks : state_->levels[0];
}

void Splatter::prepare(const Camera& camera, const SplatOptions& options) {
  prepareFrame(camera, options, false);
}

void Splatter::prepareFrame(const Camera& camera, const SplatOptions& options, bool allLevels) {
  State& state = *state_;
  state.frame.reset();
  ++state.frameNumber;
  // Where memory is bounded, a frame's own needs come first.
  state.bricks.nextCall();
  state.bricks.forget(options.memoryBytes == 0 ? kKeptBytes : 0);
  if (options.memoryBytes > 0 || options.gpuMemoryBytes > 0) state.canvas.canvas.reset();
  auto frame = std::make_unique<State::Frame>();
  frame->camera = camera;
  frame->options = options;
  frame->allLevels = allLevels;
  frame->view = volumeView(state.placement, camera);
  SplatStatistics& statistics = frame->statistics;
  statistics.passes = 0;
  statistics.backend = state.context ? "gl" : "cpu";
  if (state.context) statistics.glRenderer = state.context->renderer();
  const bool paper = options.formula == Formula::paper;
  if (paper && options.footprint != Footprint::kernel) {
    throw InputError("formula paper is defined for the kernel footprint; add --footprint kernel");
  }
  const Clock::time_point attenuationStart = Clock::now();
  const Towards eye = towardsEye(state.placement, camera);
  // The paper looks up the nearest direction, wherever the eye is.
  AttenuationSource source = options.attenuation;
  if (paper && source == AttenuationSource::automatic) source = AttenuationSource::interpolated;
  if (paper && source != AttenuationSource::interpolated) {
    throw InputError("formula paper takes the nearest of the 26 stored directions; leave --attenuation out");
  }
  source = state.chosen(source, eye, false);
  statistics.attenuation = attenuationSourceName(source);
  // What is swept or pinned is an array of the whole volume; so is all else where there is room, which for a whole
  // picture is faster than bricks.
  const bool nearField = hasNearField(source, options.footprint);
  const bool fits =
      options.memoryBytes == 0 ||
      (!allLevels && options.memoryBytes >= state.gridBytes(options, source) + State::pictureBytes(camera) +
                                                cpuCanvasBytes(state.blockEdge));
  if (source == AttenuationSource::swept || source == AttenuationSource::pinned ||
      (nearField && options.lodPixels == 0.0 && !options.blockwise && fits)) {
    std::unique_ptr<BlockSource> coarser;
    if (allLevels && nearField) {
      state.lookIntoFile(*frame, eye, source);
      coarser = std::move(frame->source);
    }
    state.lookIntoGrids(*frame, eye, source);
    if (coarser) frame->source = std::make_unique<LevelledBlockSource>(std::move(frame->source), std::move(coarser));
  } else {
    state.lookIntoFile(*frame, eye, source);
  }
  state.forgetLamps(options.memoryBytes == 0 ? kKeptBytes : 0);
  statistics.attenuationSeconds = secondsSince(attenuationStart) - statistics.lightSeconds;
  state.frame = std::move(frame);
}

Sums Splatter::draw(float quantum, std::span<const uint8_t> share, Progress& progress) {
  State& state = *state_;
  check(state.frame != nullptr, "a frame is prepared before it is drawn");
  State::Frame& frame = *state.frame;
  SplatStatistics& statistics = frame.statistics;
  ++statistics.passes;
  statistics.blocks = statistics.culledBlocks = statistics.hiddenBlocks = statistics.emptyBlocks = 0;
  statistics.splats = statistics.culledSplats = statistics.hiddenSplats = statistics.fragments = statistics.pieces = 0;
  statistics.visiblePieces = 0;
  statistics.blocksOfLevel.clear();
  statistics.splatsOfLevel.clear();
  std::vector<VisibleBlock> drawn = frame.blocks;
  if (!share.empty()) {
    checkEqual(share.size(), frame.blocks.size(), "length of a share");
    drawn.clear();
    for (size_t i = 0; i < frame.blocks.size(); ++i) {
      if (share[i] != 0) drawn.push_back(frame.blocks[i]);
    }
  }
  progress.begin("splatting", drawn.size(), "blocks");
  Sums sums = drawFrameBlocks(drawn, quantum, progress);
  progress.end();
  statistics.volumeBytes = frame.source->volumeBytes();
  return sums;
}

Sums Splatter::drawFrameBlocks(std::span<const VisibleBlock> blocks, float quantum, Progress& progress) {
  State& state = *state_;
  State::Frame& frame = *state.frame;
  FrameDrawing drawing;
  drawing.source = frame.source.get();
  drawing.placement = &state.placement;
  drawing.classified = &state.classified;
  drawing.table = &state.table;
  drawing.visibility = &*state.visibility;
  drawing.camera = &frame.camera;
  drawing.view = &frame.view;
  drawing.options = &frame.options;
  drawing.context = state.context.get();
  // What is stored is too rough to end a ray.
  drawing.endRays = frame.statistics.attenuation == attenuationSourceName(AttenuationSource::swept) ||
                    frame.statistics.attenuation == attenuationSourceName(AttenuationSource::pinned);
  drawing.blocksAtATime = frame.blocksAtATime;
  drawing.rays = &frame.rays;
  drawing.canvas = &state.canvas;
  Sums sums;
  sums.image = drawBlocks(drawing, blocks, quantum, frame.statistics, progress);
  sums.quantum = quantum;
  sums.lightScale = frame.lightScale;
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
  const VolumeView view = volumeView(state_->placement, camera);
  std::vector<BlockWork> work;
  work.reserve(blocks().size());
  for (const VisibleBlock& block : blocks()) {
    const PixelBounds bounds = pixelBounds(view, block);
    const glm::ivec2 size = bounds.empty() ? glm::ivec2(0) : bounds.high - bounds.low;
    work.push_back({bounds.empty() ? 0 : block.visibleCells, uint64_t(size.x) * uint64_t(size.y)});
  }
  return work;
}

const SplatStatistics& Splatter::statistics() const {
  check(state_->frame != nullptr, "a frame is prepared before its statistics are read");
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

SplatResult Splatter::refine(const Camera& camera, const SplatOptions& options,
                             const std::function<void(size_t n, const Sums& sums)>& show, Progress& progress) {
  State& state = *state_;
  if (state.file == nullptr || state.file->levels() < 2) {
    throw InputError(fmt::format("{}: has no coarser levels; make it with freevoxel precompute --levels 0",
                                 state.file != nullptr ? state.file->path() : "a volume without an attenuation file"));
  }
  prepareFrame(camera, options, true);
  state.findLevels();
  State::Frame& frame = *state.frame;
  const Refinement refinement = refinementTo(frame.blocks, state.levels, state.blockEdge, frame.view);
  progress.begin("refining", refinement.steps.size() + 1, "pictures");
  const auto shown = [&](size_t n, const Sums& sums) {
    if (!sumsAreExact(sums)) return false;
    show(n, sums);
    progress.advance(1);
    return true;
  };
  Sums sums;
  float quantum = options.firstQuantum;
  for (bool exact = false; !exact; quantum = exact ? quantum : nextQuantum(quantum)) {
    ++frame.statistics.passes;
    sums = drawFrameBlocks(refinement.first, quantum, silentProgress());
    exact = shown(0, sums);
    for (size_t n = 0; n < refinement.steps.size() && exact; ++n) {
      const Sums removed = drawFrameBlocks(refinement.steps[n].removed, quantum, silentProgress());
      const Sums added = drawFrameBlocks(refinement.steps[n].added, quantum, silentProgress());
      // What is removed is part of the sum, and nothing is negative: the difference is exact if the sum was, and the
      // new sum proves itself.
      for (size_t i = 0; i < sums.image.pixels.size(); ++i)
        sums.image.pixels[i] = sums.image.pixels[i] - removed.image.pixels[i] + added.image.pixels[i];
      exact = shown(n + 1, sums);
    }
  }
  // Where a coarse picture needed a larger quantum, the fine one by itself need not.
  for (float finer = options.firstQuantum; finer < quantum; finer = nextQuantum(finer)) {
    Sums direct = drawFrameBlocks(frame.blocks, finer, silentProgress());
    if (!shown(refinement.steps.size(), direct)) continue;
    sums = std::move(direct);
    break;
  }
  progress.end();
  frame.statistics.volumeBytes = frame.source->volumeBytes();
  return {std::move(sums), frame.statistics};
}

BlendedResult Splatter::renderBlended(const Camera& camera, BlendKernel kernel, const SplatOptions& options,
                                      Progress& progress) {
  State& state = *state_;
  BlendedResult result;
  SplatStatistics& statistics = result.statistics;
  statistics.backend = "cpu";
  const VolumeView view = volumeView(state.placement, camera);
  const Clock::time_point lightStart = Clock::now();
  const LightGrid light = state.lightVoxels(camera, options, statistics);
  statistics.lightSeconds = secondsSince(lightStart);
  const Clock::time_point setupStart = Clock::now();
  const KernelSetup setup(view, state.classified,
                          kernel == BlendKernel::gaussian ? KernelEmission::peak : KernelEmission::telescoping, 1.0f,
                          0.0f);
  const GridBlockSource source(state.grid(), nullptr, light, state.blockEdge);
  std::vector<BlendSplat> splats;
  KernelSetup::Counts counts;
  BlockSamples samples;
  for (const VisibleBlock& block : state.levels[0]) {
    if (!setup.mayTouchImage(block.origin, state.blockEdge)) {
      ++statistics.culledBlocks;
      continue;
    }
    ++statistics.blocks;
    source.gather(block, samples);
    setup.appendWithDistance(samples, block, state.dims, state.blockEdge, splats, counts);
  }
  statistics.splats = splats.size();
  statistics.culledSplats = counts.culledSplats;
  statistics.fragments = counts.fragments;
  statistics.setupSeconds = secondsSince(setupStart);
  const Clock::time_point drawStart = Clock::now();
  progress.begin("blending", 1, "pictures");
  result.image = blendKernels(std::move(splats), kernel, camera.imageSize);
  for (size_t i = 0; i < result.image.pixels.size(); ++i) {
    if (i % 4 != 3) result.image.pixels[i] *= light.scale;
  }
  progress.advance(1);
  progress.end();
  statistics.drawSeconds = secondsSince(drawStart);
  return result;
}

}  // namespace freevoxel
