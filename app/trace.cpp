// freevoxel trace: a picture of volumes, meshes and spheres in per-voxel lists, by rays.
#include <fmt/core.h>

#include <chrono>
#include <memory>
#include <numbers>

#include "app/command.h"
#include "app/input_file.h"
#include "app/light_options.h"
#include "app/picture_output.h"
#include "app/scene_file.h"
#include "app/shared_drawing.h"
#include "app/traced_scene.h"
#include "base/error.h"
#include "gl/context.h"
#include "hierarchy/attenuation_file.h"
#include "hierarchy/value_grid.h"
#include "parallel/gather_rows.h"
#include "precompute/checksums.h"
#include "splat/splat.h"
#include "volume/read_volume.h"
#include "volume/resample.h"
#include "volume/transfer_presets.h"
#include "voxlink/gl_buffers.h"
#include "voxlink/read_mesh.h"
#include "voxlink/scene.h"
#include "voxlink/voxlink.h"

namespace freevoxel {

namespace {

constexpr int kMostTurnViews = 3600;

struct TraceOptions {
  std::string input, transfer, edit;
  PictureOptions picture;
  VolumeOptions raw;
  CameraOptions camera;
  LightOptions light;
  VoxLinkOptions voxlink;
  std::optional<Shadows> shadows;  ///< attenuation of one volume, rays in a scene unless set
  int maxDepth = SceneVoxLinkOptions().maxDepth;
  uint64_t rayBuffer = SceneVoxLinkOptions().rayBuffer;
  bool revoxelise = false;
  Backend backend = Backend::automatic;
  std::optional<int> resolution;
  int turn = 0;
};

/// What is traced: values and what they look like, before and after an edit.
struct TracedVolume {
  ValueGrid grid;
  TransferFunction transfer;
  uint64_t voxels = 0;
};

TracedVolume readFile(const TraceOptions& options, Session& session) {
  if (hasVolumeOptions(options.raw)) throw UsageError("options for raw volumes make no sense for an .fvx file");
  if (options.resolution) throw UsageError("--resolution needs a volume: an .fvx file has its own");
  const AttenuationFile file(options.input);
  TracedVolume traced;
  traced.transfer = options.transfer.empty() ? file.transfer() : readTransferFunction(options.transfer);
  if (traced.transfer.low != file.transfer().low || traced.transfer.high != file.transfer().high) {
    throw InputError(fmt::format(
        "{}: holds values from {} to {}, found a transfer function from {} to {}; trace the "
        "volume instead",
        options.input, file.transfer().low, file.transfer().high, traced.transfer.low, traced.transfer.high));
  }
  traced.grid = session.timed("read", [&] { return valueGrid(file); });
  return traced;
}

TracedVolume readVolumeToTrace(const TraceOptions& options, Session& session) {
  if (options.transfer.empty()) {
    openVolume(options.input, options.raw);  // what ails the file comes first
    throw UsageError("--transfer is required to trace a volume");
  }
  Volume volume = session.timed("read", [&] { return readVolume(options.input, options.raw); });
  TracedVolume traced;
  traced.transfer = chooseTransfer(options.transfer, volume);
  volume.header.labels = volume.header.labels || traced.transfer.isLabels;
  if (options.resolution) {
    volume =
        session.timed("resample", [&] { return resampled(volume, resampledDims(volume.header, *options.resolution)); });
  }
  traced.grid = session.timed("read", [&] { return valueGrid(volume, traced.transfer); });
  return traced;
}

/// The context to trace with; null for the CPU.
std::unique_ptr<gl::Context> chooseContext(Backend backend) {
  std::unique_ptr<gl::Context> context;
  if (backend == Backend::cpu) return context;
  try {
    context = std::make_unique<gl::Context>();
  } catch (const MachineError&) {
    if (backend == Backend::gl) throw;
  }
  // A GL that runs on the CPU is slower there than our own code.
  if (backend == Backend::automatic && context && context->isSoftware()) context.reset();
  return context;
}

uint64_t hashOf(const TracedScene& scene) {
  std::vector<uint64_t> parts = {contentHash(std::as_bytes(std::span(scene.mesh.positions))),
                                 contentHash(std::as_bytes(std::span(scene.mesh.triangles))),
                                 contentHash(std::as_bytes(std::span(scene.mesh.materialOfTriangle))),
                                 contentHash(std::as_bytes(std::span(scene.spheres.centres))),
                                 contentHash(std::as_bytes(std::span(scene.spheres.radii)))};
  for (const SceneVolume& volume : scene.volumes)
    parts.push_back(contentHash(std::as_bytes(std::span(volume.grid.codes))));
  return contentHash(std::as_bytes(std::span(std::as_const(parts))));
}

/// A picture, every rank's band of rows traced by itself. Of no use on ranks other than 0.
template <class Tracer>
Image traceTogether(Tracer& voxlink, const Camera& camera, Session& session) {
  const Ranks& ranks = session.ranks();
  const ImageRows rows = bandOfRows(camera, ranks.rank(), ranks.rankCount());
  return gatherRows(ranks, voxlink.trace(camera, rows, session.progress()));
}

/// Who traced what: rows, seconds, and rays of which the sum is the picture's.
template <class Statistics>
void reportRanks(const Statistics& done, const Camera& camera, Session& session) {
  const Ranks& ranks = session.ranks();
  if (ranks.rankCount() == 1) return;
  const ImageRows rows = bandOfRows(camera, ranks.rank(), ranks.rankCount());
  nlohmann::ordered_json mine = {{"rank", ranks.rank()},
                                 {"host", hostName()},
                                 {"seconds", {{"build", done.buildSeconds}, {"trace", done.traceSeconds}}},
                                 {"firstRow", rows.first},
                                 {"rows", rows.count}};
  if constexpr (requires { done.rays; }) mine["rays"] = done.rays;
  ranks.agree();
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  uint64_t rays = 0;
  for (const std::string& text : ranks.gatherEverywhere(mine.dump())) {
    all.push_back(nlohmann::ordered_json::parse(text));
    rays += all.back().value("rays", uint64_t(0));
  }
  if (mine.contains("rays")) session.statistics["rays"] = rays;
  session.statistics["ranks"] = std::move(all);
}

/// The paper's measurement: a full turn about y, then one about x. `drawFrame` is called with each view's camera.
template <class DrawFrame>
void measureTurns(const Camera& camera, int views, Session& session, const DrawFrame& drawFrame) {
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
  double seconds = 0.0;
  for (const glm::dvec3 axis : {glm::dvec3(0.0, 1.0, 0.0), glm::dvec3(1.0, 0.0, 0.0)}) {
    for (int i = 0; i < views; ++i) {
      const Camera view = turned(camera, 2.0 * std::numbers::pi * i / views, axis);
      const auto start = std::chrono::steady_clock::now();
      drawFrame(view);
      const double frame = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      frames.push_back(frame);
      seconds += frame;
    }
  }
  const double rays = double(camera.imageSize.x) * camera.imageSize.y * 2.0 * views;
  session.statistics["frameSeconds"] = frames;
  session.statistics["framesPerSecond"] = 2.0 * views / seconds;
  session.statistics["raysPerSecond"] = rays / seconds;
}

void reportStatistics(const VoxLinkStatistics& done, Session& session) {
  session.addSeconds("build", done.buildSeconds);
  session.addSeconds("shadows", done.shadowSeconds);
  session.addSeconds("light", done.lightSeconds);
  session.addSeconds("trace", done.traceSeconds);
  session.statistics["backend"] = done.backend;
  if (!done.glRenderer.empty()) session.statistics["glRenderer"] = done.glRenderer;
  session.statistics["voxels"] = done.voxels;
  session.statistics["storedVoxels"] = done.storedVoxels;
  session.statistics["bricks"] = done.bricks;
  session.statistics["occupiedBricks"] = done.occupiedBricks;
  session.statistics["bufferBytes"] = done.bufferBytes;
  session.statistics["bytesPerStoredVoxel"] = double(done.bufferBytes) / double(done.storedVoxels);
  session.statistics["builds"] = done.builds;
  session.statistics["passes"] = done.passes;
}

void reportStatistics(const SceneVoxLinkStatistics& done, Session& session) {
  session.addSeconds("build", done.buildSeconds);
  session.addSeconds("shadows", done.shadowSeconds);
  session.addSeconds("trace", done.traceSeconds);
  session.statistics["backend"] = done.backend;
  if (!done.glRenderer.empty()) session.statistics["glRenderer"] = done.glRenderer;
  session.statistics["voxels"] = done.voxels;
  session.statistics["storedVoxels"] = done.storedVoxels;
  session.statistics["storedFragments"] = done.fragments;
  session.statistics["bricks"] = done.bricks;
  session.statistics["occupiedBricks"] = done.occupiedBricks;
  session.statistics["bufferBytes"] = done.bufferBytes;
  session.statistics["bytesPerStoredVoxel"] = double(done.bufferBytes) / double(done.storedVoxels);
  session.statistics["rays"] = done.rays;
  session.statistics["passes"] = done.passes;
}

Outcome traceObjects(const TraceOptions& options, const SceneObjects& objects, Session& session) {
  if (!options.edit.empty()) throw UsageError("--edit is for one volume");
  const TracedScene scene = readTracedScene(objects, session);
  expectSameOnAllRanks(session.ranks(), hashOf(scene), options.input);
  const Camera camera = makeCamera(options.camera, sceneBounds(scene));
  SceneVoxLinkOptions how;
  how.resolution = options.resolution.value_or(how.resolution);
  how.brickEdge = options.voxlink.brickEdge;
  how.threshold = options.voxlink.threshold;
  how.steps = options.voxlink.steps;
  how.gpuMemory = options.voxlink.gpuMemory;
  how.maxDepth = options.maxDepth;
  how.rayBuffer = options.rayBuffer;
  const std::unique_ptr<gl::Context> context = chooseContext(options.backend);
  SceneVoxLink voxlink(scene, how, context.get(), session.progress());
  voxlink.light(makeLighting(options.light), options.shadows.value_or(Shadows::rays));
  const Image picture = traceTogether(voxlink, camera, session);
  reportStatistics(voxlink.statistics(), session);
  reportRanks(voxlink.statistics(), camera, session);
  if (options.turn > 0) {
    measureTurns(camera, options.turn, session, [&](const Camera& view) {
      if (options.revoxelise) voxlink.update(scene, session.progress());
      traceTogether(voxlink, view, session);
    });
  }
  if (session.ranks().isRoot()) writePicture(options.picture, picture, session);
  return Outcome::done;
}

Outcome trace(TraceOptions options, const CLI::App& command, Session& session) {
  checkOutputName(options.picture);
  SceneObjects objects;
  if (isSceneFile(options.input)) {
    useScene(command,
             {options.input, options.transfer, options.raw, options.camera, options.light, options.picture, &objects});
  } else if (isMeshFile(options.input) || (isSphereFile(options.input) && !isVolumeArray(options.input))) {
    if (hasVolumeOptions(options.raw) || !options.transfer.empty()) {
      throw UsageError("--transfer and options for raw volumes make no sense for meshes and spheres");
    }
    objects = sceneOfFile(options.input);
  }
  if (!objects.empty()) return traceObjects(options, objects, session);
  if (options.revoxelise) throw UsageError("--revoxelise is for meshes, spheres and scenes of several objects");
  const TracedVolume traced =
      isAttenuationFile(options.input) ? readFile(options, session) : readVolumeToTrace(options, session);
  expectSameOnAllRanks(session.ranks(), contentHash(std::as_bytes(std::span(traced.grid.codes))), options.input);
  const Camera camera = makeCamera(options.camera, worldBounds(traced.grid.placement, traced.grid.dims));
  const Lighting lighting = makeLighting(options.light);
  std::optional<TransferFunction> edited;
  if (!options.edit.empty()) {
    edited = readTransferFunction(options.edit);
    if (edited->low != traced.transfer.low || edited->high != traced.transfer.high ||
        edited->isLabels != traced.transfer.isLabels) {
      throw InputError(fmt::format("{}: expected the range of the transfer function it edits, {} to {}, found {} to {}",
                                   options.edit, traced.transfer.low, traced.transfer.high, edited->low, edited->high));
    }
  }
  const std::unique_ptr<gl::Context> context = chooseContext(options.backend);
  VoxLink voxlink(traced.grid, traced.transfer, options.voxlink, context.get(), session.progress());
  if (edited) voxlink.edit(traced.grid, *edited, session.progress());
  voxlink.light(lighting, options.shadows.value_or(Shadows::attenuation));
  const Image picture = traceTogether(voxlink, camera, session);
  reportStatistics(voxlink.statistics(), session);
  reportRanks(voxlink.statistics(), camera, session);
  if (options.turn > 0) {
    measureTurns(camera, options.turn, session, [&](const Camera& view) { traceTogether(voxlink, view, session); });
  }
  if (session.ranks().isRoot()) writePicture(options.picture, picture, session);
  return Outcome::done;
}

std::optional<Shadows> parseShadows(std::string_view text) {
  if (text == "rays") return Shadows::rays;
  if (text == "attenuation") return Shadows::attenuation;
  if (text == "none") return Shadows::none;
  throw UsageError(fmt::format("expected rays, attenuation or none, found '{}'", text));
}

double parseThreshold(std::string_view text) {
  const double threshold = parseNumber(text);
  if (!(threshold >= 0.0 && threshold < 1.0)) {
    throw UsageError(fmt::format("expected 0 up to below 1, found {}", text));
  }
  return threshold;
}

}  // namespace

Command addTrace(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<TraceOptions>();
  CLI::App* command =
      addSubcommand(program, "trace", "trace rays through voxels of volumes, meshes and spheres (VoxLink)",
                    "freevoxel trace cloud.nrrd --transfer cloud.json --orbit 30,20 -o cloud.png");
  command
      ->add_option(
          "INPUT", options->input,
          "a volume, which needs --transfer, an attenuation file (.fvx), a mesh or spheres (docs/meshes.md), or a "
          "scene (.json)")
      ->required();
  addOutputOption(*command, options->picture);
  addTransferOption(*command, options->transfer, "; for an attenuation file one of the same range (default: its own)");
  addParsed<std::optional<int>>(
      *command, "--resolution", options->resolution, "N",
      fmt::format("voxels along the longest edge, 1 to {}: a volume is resampled (default: its own; of meshes, spheres "
                  "and several objects {})",
                  SceneVoxLinkOptions::kMostResolution, SceneVoxLinkOptions().resolution),
      [](std::string_view text) {
        return std::optional<int>(int(parseWhole(text, 1, SceneVoxLinkOptions::kMostResolution)));
      });
  addChoice<int>(*command, "--brick", options->voxlink.brickEdge, {{"4", 4}, {"8", 8}, {"16", 16}},
                 "voxels along the edge of a brick");
  addParsed<double>(
      *command, "--threshold", options->voxlink.threshold, "OPACITY",
      fmt::format("voxels of more opacity are stored, 0 up to below 1 (default {})", options->voxlink.threshold),
      parseThreshold);
  addParsed<std::optional<Shadows>>(
      *command, "--shadows", options->shadows, "rays|attenuation|none",
      "what lamps lose on their way: by rays, by attenuation of a volume along lattice directions, or nothing "
      "(default: "
      "attenuation for one volume, rays for meshes, spheres and scenes of several objects)",
      parseShadows);
  addParsed<int>(*command, "--max-depth", options->maxDepth, "N",
                 fmt::format("how often a ray may be reflected or refracted, 0 to {} (default {})",
                             SceneVoxLinkOptions::kMostDepth, options->maxDepth),
                 [](std::string_view text) { return int(parseWhole(text, 0, SceneVoxLinkOptions::kMostDepth)); });
  command
      ->add_option("--edit", options->edit,
                   "build for --transfer, then show this one: voxels are stored anew only if it shows some that were "
                   "left out")
      ->type_name("FILE");
  addParsed<int>(
      *command, "--steps", options->voxlink.steps, "N",
      fmt::format("of a ray per pass on the GPU, 1 to {} (default {})", GlVoxLink::kMostSteps, options->voxlink.steps),
      [](std::string_view text) { return int(parseWhole(text, 1, GlVoxLink::kMostSteps)); });
  addChoice<Backend>(*command, "--backend", options->backend,
                     {{"auto", Backend::automatic}, {"gl", Backend::gl}, {"cpu", Backend::cpu}},
                     "what builds and traces");
  addParsed<uint64_t>(*command, "--gpu-memory", options->voxlink.gpuMemory, "BYTES",
                      fmt::format("that may be allocated on the GPU; K, M, G are understood (default {}G)",
                                  options->voxlink.gpuMemory >> 30),
                      parseBytes);
  addParsed<int>(*command, "--turn", options->turn, "VIEWS",
                 fmt::format("also measure a full turn about y and one about x of so many views each, 1 to {}; times "
                             "are in --stats",
                             kMostTurnViews),
                 [](std::string_view text) { return int(parseWhole(text, 1, kMostTurnViews)); });
  addParsed<uint64_t>(
      *command, "--ray-buffer", options->rayBuffer, "BYTES",
      fmt::format("of --gpu-memory for rays of scenes with surfaces, where fewer mean more passes; K, M, "
                  "G are understood (default {}M)",
                  options->rayBuffer >> 20),
      parseBytes);
  command->add_flag("--revoxelise", options->revoxelise,
                    "with --turn: meshes and spheres are voxelised anew for every view");
  addBackgroundOption(*command, options->picture);
  addCameraOptions(*command, options->camera);
  addLightOptions(*command, options->light);
  addVolumeOptions(*command, options->raw);
  addCommonOptions(*command, common);
  return {command, [options, command](Session& session) { return trace(*options, *command, session); }, true};
}

}  // namespace freevoxel
