#include "voxlink/scene.h"

#include <chrono>
#include <glm/glm.hpp>
#include <optional>

#include "base/error.h"
#include "voxlink/gl_scene.h"
#include "voxlink/scene_buffers.h"
#include "voxlink/trace_scene.h"

namespace freevoxel {

namespace {

/// Adds the time from its making to its end to `seconds`.
class Timer {
 public:
  explicit Timer(double& seconds) : seconds_(seconds) {}
  ~Timer() { seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void checkOptions(const SceneVoxLinkOptions& options) {
  checkBrickEdge(options.brickEdge);
  if (options.steps < 1 || options.steps > GlScene::kMostSteps) {
    throw InputError(fmt::format("VoxLink: expected 1 to {} steps, found {}", GlScene::kMostSteps, options.steps));
  }
  if (!(options.threshold >= 0.0 && options.threshold < 1.0)) {
    throw InputError(fmt::format("VoxLink: expected a threshold from 0 up to below 1, found {}", options.threshold));
  }
  if (options.maxDepth < 0 || options.maxDepth > SceneVoxLinkOptions::kMostDepth) {
    throw InputError(fmt::format("VoxLink: expected 0 to {} reflections, found {}", SceneVoxLinkOptions::kMostDepth,
                                 options.maxDepth));
  }
}

}  // namespace

struct SceneVoxLink::State {
  SceneVoxLinkOptions options;
  Box box;
  SceneVoxels voxels;
  SceneBuffers buffers;  ///< cpu; gl: what lights volumes needs them
  std::optional<GlScene> onGpu;
  Lighting lighting;
  Shadows shadows = Shadows::none;
  LightShares shares;
  SceneVoxLinkStatistics statistics;

  void build(const TracedScene& scene, Progress& progress);
};

void SceneVoxLink::State::build(const TracedScene& scene, Progress& progress) {
  const Timer timer(statistics.buildSeconds);
  voxels = sceneVoxels(scene, sceneGrid(box, options.resolution), options.threshold);
  if (onGpu) {
    onGpu->build(voxels, options.brickEdge, statistics.degenerateTriangles, progress);
    buffers = SceneBuffers{};
    statistics.storedVoxels = onGpu->storedVoxels();
    statistics.fragments = onGpu->fragments();
    statistics.occupiedBricks = onGpu->occupiedBricks();
  } else {
    progress.begin("building", 1, "scene");
    buffers = buildSceneBuffers(voxels, options.brickEdge, statistics.degenerateTriangles);
    progress.end();
    statistics.storedVoxels = buffers.storedVoxels();
    statistics.fragments = buffers.fragments.size();
    statistics.occupiedBricks = buffers.occupiedBricks();
  }
  voxels.mesh = nullptr;
  voxels.samples = {};
  const BrickGrid& grid = onGpu ? onGpu->grid() : buffers.grid;
  statistics.voxels = voxelCount(voxels.grid.dims);
  statistics.bricks = grid.bricks();
  statistics.bufferBytes = (grid.bricks() + 31) / 32 * sizeof(BrickWord) +
                           statistics.occupiedBricks * uint64_t(shared::headerWords(grid.edge)) * 4 +
                           (statistics.storedVoxels + 1) * 4 + statistics.fragments * sizeof(SceneFragment) +
                           SceneBuffers::sceneTableBytes(voxels);
}

SceneVoxLink::SceneVoxLink(const TracedScene& scene, const SceneVoxLinkOptions& options, const gl::Context* context,
                           Progress& progress)
    : state_(std::make_unique<State>()) {
  checkOptions(options);
  State& state = *state_;
  state.options = options;
  state.statistics.backend = context != nullptr ? "gl" : "cpu";
  if (context != nullptr) {
    state.statistics.glRenderer = context->renderer();
    state.onGpu.emplace(*context, options.gpuMemory, options.rayBuffer);
  }
  state.box = sceneBounds(scene);
  state.build(scene, progress);
}

SceneVoxLink::~SceneVoxLink() = default;
SceneVoxLink::SceneVoxLink(SceneVoxLink&& other) noexcept = default;

void SceneVoxLink::update(const TracedScene& scene, Progress& progress) {
  State& state = *state_;
  const Box box = sceneBounds(scene);
  state.box = {glm::min(state.box.lower, box.lower), glm::max(state.box.upper, box.upper)};
  state.build(scene, progress);
  light(state.lighting, state.shadows);
}

void SceneVoxLink::light(const Lighting& lighting, Shadows shadows) {
  checkLighting(lighting);
  if (shadows == Shadows::attenuation) {
    throw InputError("VoxLink: shadows by attenuation are for volumes alone; scenes with surfaces have rays or none");
  }
  State& state = *state_;
  const Timer timer(state.statistics.shadowSeconds);
  state.lighting = lighting;
  state.shadows = shadows;
  const bool volumes = !state.voxels.volumeMaterials.empty() && !lighting.unlit();
  if (state.onGpu && volumes && state.buffers.fragments.empty()) state.buffers = state.onGpu->download();
  if (volumes) state.shares = volumeShares(state.buffers, state.voxels, lighting, shadows);
}

Image SceneVoxLink::trace(const Camera& camera, ImageRows rows, Progress& progress) {
  State& state = *state_;
  const Timer timer(state.statistics.traceSeconds);
  std::vector<uint32_t> light;
  if (!state.lighting.unlit()) light = lightVolumes(state.buffers, state.voxels, state.lighting, state.shares, camera);
  const SceneTracing tracing{state.lighting, state.shadows, state.options.maxDepth};
  if (state.onGpu) {
    state.onGpu->setVolumeLight(light);
    return state.onGpu->trace(tracing, camera, rows, state.options.steps, state.statistics.rays,
                              state.statistics.passes, progress);
  }
  state.statistics.passes = 1;
  return traceScene(state.buffers, state.voxels, light, tracing, camera, rows, state.statistics.rays, progress);
}

const SceneVoxLinkStatistics& SceneVoxLink::statistics() const {
  return state_->statistics;
}

}  // namespace freevoxel
