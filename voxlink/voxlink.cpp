#include "voxlink/voxlink.h"

#include <chrono>
#include <optional>

#include "base/error.h"
#include "voxlink/gl_buffers.h"
#include "voxlink/light_voxels.h"
#include "voxlink/trace_rays.h"

namespace freevoxel {

namespace {

/// Adds the time from its making to its end to `seconds`.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

bool sameCoding(const ValueCoding& a, const ValueCoding& b) {
  return a.low == b.low && a.step == b.step && a.largest == b.largest;
}

}  // namespace

struct VoxLink::State {
  const ValueGrid* grid;
  VoxLinkOptions options;
  const gl::Context* context;
  std::vector<uint8_t> built;  // per code: stored in the buffers
  std::vector<VoxelMaterial> materials;
  VoxLinkBuffers buffers;  // cpu; gl: downloaded when something needs them
  std::optional<GlVoxLink> onGpu;
  Lighting lighting;
  Shadows shadows = Shadows::none;
  LightShares shares;
  std::vector<uint32_t> light;  ///< cpu
  bool lit = false;             ///< light at the voxels is that of `lighting`, whatever the camera
  VoxLinkStatistics statistics;

  void build(Progress& progress);
  /// After new materials: they change what gets through.
  void findShares();
};

void VoxLink::State::build(Progress& progress) {
  const Stopwatch watch(statistics.buildSeconds);
  ++statistics.builds;
  if (onGpu) {
    onGpu->build(*grid, built, options.brickEdge, progress);
    buffers = VoxLinkBuffers{};
    statistics.storedVoxels = onGpu->fragments();
    statistics.occupiedBricks = onGpu->occupiedBricks();
  } else {
    buffers = buildBuffers(*grid, built, options.brickEdge);
    statistics.storedVoxels = buffers.fragments.size();
    statistics.occupiedBricks = buffers.occupiedBricks();
  }
  const BrickGrid& bricks = onGpu ? onGpu->grid() : buffers.grid;
  statistics.voxels = voxelCount(grid->dims);
  statistics.bricks = bricks.bricks();
  statistics.bufferBytes = (bricks.bricks() + 31) / 32 * sizeof(BrickWord) +
                           statistics.occupiedBricks * uint64_t(shared::headerWords(bricks.edge)) * 4 +
                           statistics.storedVoxels * 4 + materials.size() * sizeof(VoxelMaterial);
}

void VoxLink::State::findShares() {
  lit = false;
  light.clear();
  if (lighting.unlit()) {
    if (onGpu) onGpu->unlit();
    return;
  }
  const Stopwatch watch(statistics.shadowSeconds);
  if (!onGpu) {
    shares = lightShares(buffers, materials, lighting.lights, shadows);
    return;
  }
  if (shadows == Shadows::rays) {
    onGpu->traceShares(lighting.lights);
    glFinish();
    return;
  }
  if (shadows == Shadows::attenuation && buffers.fragments.empty()) buffers = onGpu->download();
  onGpu->setShares(shadows == Shadows::attenuation
                       ? attenuationShares(buffers, materials, lighting.lights)
                       : LightShares(size_t(onGpu->fragments()) * lighting.lights.size(), uint8_t(255)));
}

VoxLink::VoxLink(const ValueGrid& grid, const TransferFunction& transfer, const VoxLinkOptions& options,
                 const gl::Context* context, Progress& progress)
    : state_(std::make_unique<State>()) {
  checkBrickEdge(options.brickEdge);
  if (!(options.threshold >= 0.0 && options.threshold < 1.0)) {
    throw InputError(fmt::format("VoxLink: expected a threshold from 0 up to below 1, found {}", options.threshold));
  }
  if (options.steps < 1 || options.steps > GlVoxLink::kMostSteps) {
    throw InputError(fmt::format("VoxLink: expected 1 to {} steps, found {}", GlVoxLink::kMostSteps, options.steps));
  }
  State& state = *state_;
  state.grid = &grid;
  state.options = options;
  state.context = context;
  state.statistics.backend = context != nullptr ? "gl" : "cpu";
  if (context != nullptr) {
    state.statistics.glRenderer = context->renderer();
    state.onGpu.emplace(*context, options.gpuMemory);
  }
  state.built = storedCodes(transfer, grid.coding, options.threshold);
  state.materials = voxelMaterials(transfer, grid.coding, state.built);
  state.build(progress);
  if (state.onGpu) state.onGpu->setMaterials(state.materials);
}

VoxLink::~VoxLink() = default;
VoxLink::VoxLink(VoxLink&& other) noexcept = default;

void VoxLink::edit(const ValueGrid& grid, const TransferFunction& transfer, Progress& progress) {
  State& state = *state_;
  const std::vector<uint8_t> wanted = storedCodes(transfer, grid.coding, state.options.threshold);
  const bool rebuild = !sameCoding(grid.coding, state.grid->coding) || needsRebuild(grid, state.built, wanted);
  state.materials = voxelMaterials(transfer, grid.coding, wanted);
  if (rebuild) {
    state.grid = &grid;
    state.built = wanted;
    state.build(progress);
  }
  if (state.onGpu) state.onGpu->setMaterials(state.materials);
  state.findShares();
}

void VoxLink::light(const Lighting& lighting, Shadows shadows) {
  checkLighting(lighting);
  state_->lighting = lighting;
  state_->shadows = shadows;
  state_->findShares();
}

Image VoxLink::trace(const Camera& camera, ImageRows rows, Progress& progress) {
  State& state = *state_;
  VoxLinkStatistics& statistics = state.statistics;
  if (!state.lighting.unlit() && !state.lit) {
    const Stopwatch watch(statistics.lightSeconds);
    if (state.onGpu) {
      state.onGpu->light(state.lighting, camera);
      glFinish();
    } else {
      lightVoxels(state.buffers, state.lighting, state.shares, camera, state.light);
    }
    state.lit = state.lighting.shading == Shading::none;
  }
  const Stopwatch watch(statistics.traceSeconds);
  if (state.onGpu) return state.onGpu->trace(camera, rows, state.options.steps, statistics.passes);
  statistics.passes = 1;
  return traceRays(state.buffers, state.materials, state.light, camera, rows, progress);
}

const VoxLinkStatistics& VoxLink::statistics() const {
  return state_->statistics;
}

}  // namespace freevoxel
