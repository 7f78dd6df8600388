// freevoxel render: a picture of an attenuation file or a volume.
#include <fmt/core.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <numbers>

#include "app/command.h"
#include "app/input_file.h"
#include "app/level_options.h"
#include "app/light_options.h"
#include "app/picture_output.h"
#include "app/precompute_report.h"
#include "app/program_memory.h"
#include "app/progressive_folder.h"
#include "app/scene_file.h"
#include "app/shared_drawing.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "hierarchy/attenuation_file.h"
#include "precompute/checksums.h"
#include "splat/raycast.h"
#include "splat/splat.h"
#include "volume/read_volume.h"
#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

constexpr int kMostFrames = 9999;

enum class PictureFormula { paper, direct, normalised, blended, raycast };

struct RenderOptions {
  std::string input, sums, transfer, progressive;
  PictureOptions picture;
  VolumeOptions raw;
  CameraOptions camera;
  LightOptions light;
  PictureFormula formula = PictureFormula::normalised;
  SplatOptions splat;
  BlendKernel blendKernel = BlendKernel::normalised;
  Backend backend = Backend::automatic;
  RaycastOptions raycast;
  ShareOptions share;
  int frames = 0;  ///< of a turntable; 0: one picture
};

Formula splatFormula(PictureFormula formula) {
  switch (formula) {
    case PictureFormula::paper:
      return Formula::paper;
    case PictureFormula::direct:
      return Formula::direct;
    case PictureFormula::normalised:
      return Formula::normalised;
    case PictureFormula::blended:
    case PictureFormula::raycast:
      break;
  }
  throw InternalError("internal error: this formula has no sums");
}

SplatOrder parseOrder(std::string_view text) {
  constexpr std::string_view kShuffle = "shuffle:";
  if (text == "hilbert") return {SplatOrder::Kind::hilbert, 0};
  if (text == "reverse") return {SplatOrder::Kind::reverse, 0};
  if (text.starts_with(kShuffle)) return {SplatOrder::Kind::shuffle, parseSeed(text.substr(kShuffle.size()))};
  throw UsageError(fmt::format("expected hilbert, reverse or shuffle:SEED, found '{}'", text));
}

double parseStep(std::string_view text) {
  const double step = parseNumber(text);
  if (!(step >= 0.001 && step <= 1000.0)) throw UsageError(fmt::format("expected 0.001 to 1000, found {}", text));
  return step;
}

bool hasSums(PictureFormula formula) {
  return formula != PictureFormula::raycast && formula != PictureFormula::blended;
}

/// Throws UsageError if options were given that would do nothing.
void checkOptions(const RenderOptions& options, const CLI::App& command) {
  const auto given = [&](const char* name) { return command.get_option(name)->count() > 0; };
  const auto onlyWith = [&](bool allowed, std::initializer_list<const char*> names, const char* formulas) {
    for (const char* name : names) {
      if (!allowed && given(name)) throw UsageError(fmt::format("{} needs --formula {}", name, formulas));
    }
  };
  onlyWith(
      hasSums(options.formula),
      {"--order", "--backend", "--sums", "--footprint", "--attenuation", "--cull", "--lod", "--gpu-memory", "--memory"},
      "normalised, direct or paper");
  onlyWith(options.formula != PictureFormula::raycast, {"--light-attenuation"}, "normalised, direct, paper or blended");
  onlyWith(options.formula == PictureFormula::raycast, {"--raycast", "--step", "--shadow-step"}, "raycast");
  onlyWith(options.formula == PictureFormula::blended, {"--blend-kernel"}, "blended");
  onlyWith(hasSums(options.formula), {"--partition", "--composite", "--colour-by"}, "normalised, direct or paper");
  if (given("--progressive")) {
    onlyWith(hasSums(options.formula), {"--progressive"}, "normalised, direct or paper");
    for (const char* name : {"--frames", "--memory", "--colour-by"}) {
      if (given(name))
        throw UsageError(fmt::format("--progressive makes one picture better and better: leave {} out", name));
    }
    if (!isAttenuationFile(options.input)) {
      throw UsageError(
          "--progressive needs an attenuation file with levels: freevoxel precompute VOLUME --levels 0 -o FILE.fvx");
    }
  }
  checkOutputName(options.picture);
  if (!options.sums.empty() && lowerCaseExtension(options.sums) != "exr") {
    throw UsageError(fmt::format("--sums: expected a name ending in .exr, found '{}'", options.sums));
  }
}

/// Between two labels there is nothing: what interpolates values makes way for what does not. Throws UsageError if it
/// was asked for.
void keepLabelsApart(RenderOptions& options, const CLI::App& command) {
  const auto refuse = [&](const char* name, bool wrong) {
    if (wrong && command.get_option(name)->count() > 0) {
      throw UsageError(fmt::format("{} {} interpolates between values, which labels do not allow", name,
                                   command.get_option(name)->as<std::string>()));
    }
  };
  refuse("--raycast", options.raycast.classification != RaycastClassification::nearest);
  refuse("--footprint", options.splat.footprint != Footprint::kernel);
  refuse("--attenuation", options.splat.attenuation == AttenuationSource::swept);
  options.raycast.classification = RaycastClassification::nearest;
  options.splat.footprint = Footprint::kernel;
  options.splat.attenuation = AttenuationSource::interpolated;
}

/// The transfer function to draw an attenuation file with: its own, or one of the same opacities.
TransferFunction transferFor(const AttenuationFile& file, const std::string& path) {
  if (path.empty()) return file.transfer();
  TransferFunction transfer = readTransferFunction(path);
  if (!sameOpacity(transfer, file.transfer())) {
    throw InputError(
        fmt::format("{}: was made for other opacities than those of {}; run: freevoxel precompute VOLUME "
                    "--transfer {} -o {}",
                    file.path(), path, path, file.path()));
  }
  return transfer;
}

void report(const SplatStatistics& statistics, glm::ivec3 dims, const AttenuationFile* file, Session& session) {
  session.addSeconds("attenuation", statistics.attenuationSeconds);
  session.addSeconds("light", statistics.lightSeconds);
  session.addSeconds("setup", statistics.setupSeconds);
  session.addSeconds("draw", statistics.drawSeconds);
  session.statistics["backend"] = statistics.backend;
  if (!statistics.glRenderer.empty()) session.statistics["glRenderer"] = statistics.glRenderer;
  if (!statistics.attenuation.empty()) session.statistics["attenuation"] = statistics.attenuation;
  if (!statistics.lightAttenuation.empty()) session.statistics["lightAttenuation"] = statistics.lightAttenuation;
  session.statistics["voxels"] = voxelCount(dims);
  if (file != nullptr) {
    session.statistics["storedVoxels"] = file->storedVoxels();
    session.statistics["fileBytes"] = file->fileBytes();
    session.statistics["bytesPerVoxel"] = double(file->fileBytes()) / double(voxelCount(dims));
    session.statistics["nonFinite"] = file->nonFinite();
  }
  session.statistics["splats"] = statistics.splats;
  session.statistics["culledSplats"] = statistics.culledSplats;
  session.statistics["hiddenSplats"] = statistics.hiddenSplats;
  session.statistics["fragments"] = statistics.fragments;
  session.statistics["blocks"] = statistics.blocks;
  session.statistics["culledBlocks"] = statistics.culledBlocks;
  session.statistics["hiddenBlocks"] = statistics.hiddenBlocks;
  reportLevels(statistics, session);
}

/// The name of one of several pictures: "turn.png" -> "turn_0007.png".
std::string frameName(const std::string& path, int frame) {
  const std::filesystem::path name(path);
  return (name.parent_path() / fmt::format("{}_{:04}{}", name.stem().string(), frame, name.extension().string()))
      .string();
}

/// Draws the picture, or those of a turn about world y, and writes them on rank 0. `draw(camera)`: the picture, and if
/// there are any its sums.
void drawFrames(const RenderOptions& options, const Box& bounds, Session& session,
                const std::function<Image(const Camera& camera, std::optional<Sums>& sums)>& draw) {
  const Camera first = makeCamera(options.camera, bounds);
  nlohmann::ordered_json seconds = nlohmann::ordered_json::array(), hashes = nlohmann::ordered_json::array();
  for (int frame = 0; frame < std::max(1, options.frames); ++frame) {
    const auto start = std::chrono::steady_clock::now();
    const bool turning = options.frames > 0;
    const Camera camera =
        turning ? turned(first, 2.0 * std::numbers::pi * frame / options.frames, {0.0, 1.0, 0.0}) : first;
    std::optional<Sums> sums;
    Image picture = draw(camera, sums);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    if (!session.ranks().isRoot()) continue;
    const auto named = [&](const std::string& path) { return turning ? frameName(path, frame) : path; };
    if (!options.sums.empty()) {
      hashes.push_back(fmt::format("{:016x}", contentHash(std::as_bytes(std::span(sums.value().image.pixels)))));
      session.timed("write", [&] {
        writeExr(named(options.sums), sums.value().image, sumChannelNames(), session.imageMetadata());
      });
    }
    PictureOptions output = options.picture;
    output.output = named(output.output);
    writePicture(output, std::move(picture), session);
  }
  if (options.frames > 0) session.statistics["frameSeconds"] = seconds;
  if (!options.sums.empty()) session.statistics["sumsHashes"] = hashes;
}

void drawRays(const ValueGrid& grid, const TransferFunction& transfer, const RenderOptions& options, Session& session) {
  const Box bounds = worldBounds(grid.placement, grid.dims);
  drawFrames(options, bounds, session, [&](const Camera& camera, std::optional<Sums>&) {
    return session.timed("raycast",
                         [&] { return raycast(grid, transfer, camera, options.raycast, session.progress()); });
  });
}

/// The picture, and those before it in a folder of their own.
void drawProgressively(Splatter& splatter, const Box& bounds, const AttenuationFile& file, const RenderOptions& options,
                       Session& session) {
  const std::vector<std::filesystem::path> earlier = picturesOfEarlierRun(options.progressive);
  const Formula formula = splatFormula(options.formula);
  drawFrames(options, bounds, session, [&](const Camera& camera, std::optional<Sums>& sums) {
    size_t pictures = 0;
    const auto show = [&](size_t n, const Sums& shown) {
      if (n == 0 && !earlier.empty()) {
        session.tell(fmt::format("{}: removing {} pictures of an earlier run", options.progressive, earlier.size()));
        removeAll(earlier);
      }
      PictureOptions output = options.picture;
      output.output = (std::filesystem::path(options.progressive) /
                       fmt::format("{:02}{}", n, std::filesystem::path(options.picture.output).extension().string()))
                          .string();
      writePicture(output, resolve(shown, formula), session);
      pictures = n + 1;
    };
    SplatResult result = splatter.refine(camera, options.splat, show, session.progress());
    report(result.statistics, file.dims(), &file, session);
    session.statistics["passes"] = result.statistics.passes;
    session.statistics["quantum"] = result.sums.quantum;
    session.statistics["pictures"] = pictures;
    sums = std::move(result.sums);
    return resolve(*sums, formula);
  });
}

/// Either may be null: without `file` attenuation is swept, without `grid` values are read as they are needed.
void drawSplats(const ValueGrid* grid, const AttenuationFile* file, TransferFunction transfer, RenderOptions options,
                Session& session) {
  const glm::ivec3 dims = grid != nullptr ? grid->dims : file->dims();
  const Box bounds = worldBounds(grid != nullptr ? grid->placement : file->placement(), dims);
  expectSameOnAllRanks(session.ranks(),
                       file != nullptr ? file->identity() : contentHash(std::as_bytes(std::span(grid->codes))),
                       options.input);
  if (options.share.colourBy != ColourBy::value) {
    for (TransferPoint& point : transfer.points)
      point.srgb = glm::dvec3(1.0);
  }
  Splatter splatter = session.timed("open", [&] {
    return grid != nullptr ? Splatter(*grid, file, transfer, options.backend)
                           : Splatter(*file, transfer, options.backend);
  });
  if (options.splat.memoryBytes > 0) {
    // What the grid has claimed counts as data, in Splatter.
    const uint64_t gridBytes = grid != nullptr ? grid->codes.size() * sizeof(grid->codes[0]) : 0;
    options.splat.memoryBytes = memoryForData(options.splat.memoryBytes, kImageLibraryBytes) + gridBytes;
  }
  if (options.formula == PictureFormula::blended) {
    drawFrames(options, bounds, session, [&](const Camera& camera, std::optional<Sums>&) {
      BlendedResult result = splatter.renderBlended(camera, options.blendKernel, options.splat, session.progress());
      report(result.statistics, dims, file, session);
      return std::move(result.image);
    });
    return;
  }
  if (!options.progressive.empty()) return drawProgressively(splatter, bounds, *file, options, session);
  SharedDrawing drawing(splatter, options.share, options.camera.imageSize, session);
  drawFrames(options, bounds, session, [&](const Camera& camera, std::optional<Sums>& sums) {
    SplatResult result = drawing.render(camera, options.splat);
    report(result.statistics, dims, file, session);
    session.statistics["passes"] = result.statistics.passes;
    session.statistics["quantum"] = result.sums.quantum;
    sums = std::move(result.sums);
    if (!session.ranks().isRoot()) return Image();
    return session.timed("resolve", [&] { return resolve(*sums, splatFormula(options.formula)); });
  });
  drawing.report();
}

void drawFile(RenderOptions options, const CLI::App& command, Session& session) {
  if (hasVolumeOptions(options.raw)) throw UsageError("options for raw volumes make no sense for an .fvx file");
  const AttenuationFile file(options.input);
  const TransferFunction transfer = transferFor(file, options.transfer);
  if (transfer.isLabels) keepLabelsApart(options, command);
  if (options.formula != PictureFormula::raycast) return drawSplats(nullptr, &file, transfer, options, session);
  const ValueGrid grid = session.timed("read", [&] { return valueGrid(file); });
  drawRays(grid, transfer, options, session);
}

/// Whether a picture takes the 26 stored directions.
bool needsFile(const RenderOptions& options) {
  const auto stored = [](AttenuationSource source) {
    return source != AttenuationSource::automatic && source != AttenuationSource::swept;
  };
  return options.formula == PictureFormula::paper ||
         (options.formula != PictureFormula::blended && stored(options.splat.attenuation)) ||
         (!options.splat.lighting.lights.empty() && stored(options.splat.lightAttenuation));
}

void drawVolume(RenderOptions options, const CLI::App& command, Session& session) {
  if (options.transfer.empty()) {
    openVolume(options.input, options.raw);  // what ails the file comes first
    throw UsageError("--transfer is required to draw a volume");
  }
  if (options.splat.attenuation == AttenuationSource::pinned ||
      options.splat.lightAttenuation == AttenuationSource::pinned) {
    throw UsageError(
        "pinned attenuation is in an attenuation file: freevoxel precompute VOLUME --pin-light X,Y,Z -o FILE.fvx");
  }
  const Volume volume = session.timed("read", [&] { return readVolume(options.input, options.raw); });
  const TransferFunction transfer = chooseTransfer(options.transfer, volume);
  if (transfer.isLabels) keepLabelsApart(options, command);
  const ValueGrid grid = session.timed("read", [&] { return valueGrid(volume, transfer); });
  if (options.formula == PictureFormula::raycast) {
    session.statistics["voxels"] = volume.header.voxels();
    return drawRays(grid, transfer, options, session);
  }
  if (!needsFile(options)) return drawSplats(&grid, nullptr, transfer, options, session);
  session.tell("precomputing into a temporary file; `freevoxel precompute` keeps it for the next picture");
  // Never committed, so it goes when this function ends.
  const AtomicFile scratch(options.picture.output + ".fvx");
  PrecomputeOptions precomputeOptions;
  precomputeOptions.command = session.command();
  if (options.formula == PictureFormula::paper || transfer.isLabels)
    precomputeOptions.classification = Classification::voxel;
  reportPrecompute(precompute(volume, transfer, scratch.temporaryPath(), precomputeOptions, session.progress()),
                   session);
  const AttenuationFile file(scratch.temporaryPath());
  return drawSplats(&grid, &file, transfer, options, session);
}

Outcome render(RenderOptions options, const CLI::App& command, Session& session) {
  if (isSceneFile(options.input)) {
    useScene(command, {options.input, options.transfer, options.raw, options.camera, options.light, options.picture});
  }
  checkOptions(options, command);
  if (hasSums(options.formula)) options.splat.formula = splatFormula(options.formula);
  options.splat.lighting = options.raycast.lighting = makeLighting(options.light);
  if (options.formula == PictureFormula::paper && command.get_option("--footprint")->count() == 0) {
    options.splat.footprint = Footprint::kernel;
  }
  if (session.ranks().rankCount() > 1 && !options.progressive.empty()) {
    throw UsageError("--progressive is for one process: leave the launcher out");
  }
  if (session.ranks().rankCount() > 1 && !hasSums(options.formula)) {
    throw UsageError("only sums are shared among processes: run --formula raycast and blended without the launcher");
  }
  if (isAttenuationFile(options.input)) {
    drawFile(options, command, session);
  } else {
    drawVolume(options, command, session);
  }
  return Outcome::done;
}

}  // namespace

Command addRender(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* command = addSubcommand(program, "render", "make a picture of an attenuation file or a volume",
                                    "freevoxel render cloud.fvx --orbit 30,20 --size 1000x800 -o cloud.png");
  command
      ->add_option("INPUT", options->input,
                   "an attenuation file (.fvx), a volume, which needs --transfer, or a scene (.json)")
      ->required();
  addOutputOption(*command, options->picture);
  addTransferOption(*command, options->transfer,
                    "; for an attenuation file a file of the same opacities (default: the file's own)");
  addChoice<PictureFormula>(*command, "--formula", options->formula,
                            {{"normalised", PictureFormula::normalised},
                             {"direct", PictureFormula::direct},
                             {"paper", PictureFormula::paper},
                             {"blended", PictureFormula::blended},
                             {"raycast", PictureFormula::raycast}},
                            "how the picture is made: order-free splats with exact opacity, plain sums, the paper to "
                            "the letter, kernels blended back to front (which leaks), or the ray-cast reference");
  addChoice<BlendKernel>(*command, "--blend-kernel", options->blendKernel,
                         {{"normalised", BlendKernel::normalised}, {"gaussian", BlendKernel::gaussian}},
                         "of blended: the kernel of the other formulas, or a Gaussian of peak 1 as hardware splatters "
                         "had it");
  addChoice<RaycastClassification>(*command, "--raycast", options->raycast.classification,
                                   {{"post", RaycastClassification::post},
                                    {"pre", RaycastClassification::pre},
                                    {"nearest", RaycastClassification::nearest}},
                                   "of raycast: classify after or before interpolation, or do not interpolate");
  addParsed<double>(
      *command, "--step", options->raycast.step, "EDGES",
      fmt::format("of raycast: step in shortest voxel edges, 0.001 to 1000 (default {})", options->raycast.step),
      parseStep);
  addParsed<double>(
      *command, "--shadow-step", options->raycast.shadowStep, "EDGES",
      fmt::format("of raycast: the same along rays towards lamps (default {})", options->raycast.shadowStep),
      parseStep);
  addChoice<Footprint>(*command, "--footprint", options->splat.footprint,
                       {{"cell", Footprint::cell}, {"kernel", Footprint::kernel}},
                       "what a splat covers: cells between voxels, or the paper's kernels round voxels (default for "
                       "formula paper)");
  const std::vector<std::pair<std::string, AttenuationSource>> sources = {
      {"auto", AttenuationSource::automatic},
      {"stored", AttenuationSource::stored},
      {"interpolated", AttenuationSource::interpolated},
      {"swept", AttenuationSource::swept},
      {"pinned", AttenuationSource::pinned},
      {"quotient", AttenuationSource::quotient}};
  addChoice<AttenuationSource>(*command, "--attenuation", options->splat.attenuation, sources,
                               "what light loses on its way to the eye: from the file's 26 directions, corrected by a "
                               "coarse sweep; interpolated among the 26 and no more; swept for this eye; pinned in the "
                               "file; or from the 26 with the paper's quotient for an eye inside the volume; auto "
                               "takes a pin that is the eye, else stored with an attenuation file and the eye outside, "
                               "else swept");
  addChoice<AttenuationSource>(*command, "--light-attenuation", options->splat.lightAttenuation, sources,
                               "the same for light on its way from the lamps; auto takes a pin that is the lamp, else "
                               "stored with an attenuation file and the lamp outside, else swept");
  addChoice<Cull>(*command, "--cull", options->splat.cull,
                  {{"off", Cull::off}, {"none", Cull::none}, {"hidden", Cull::hidden}},
                  "leave out nothing, only what adds nothing to the picture (the bits are the same), or also what "
                  "hardly any light reaches the eye from");
  addLevelOptions(*command, options->splat);
  addChoice<Backend>(*command, "--backend", options->backend,
                     {{"auto", Backend::automatic}, {"gl", Backend::gl}, {"cpu", Backend::cpu}},
                     "what draws splats; the bits are the same");
  addParsed<SplatOrder>(*command, "--order", options->splat.order, "hilbert|reverse|shuffle:SEED",
                        "order of splats; the bits are the same (default hilbert)", parseOrder);
  command->add_option("--sums", options->sums, "write the six sums of every pixel: R G B O DepthHigh DepthLow")
      ->type_name("FILE.exr");
  addChoice<ColourBy>(
      *command, "--colour-by", options->share.colourBy,
      {{"value", ColourBy::value}, {"rank", ColourBy::rank}, {"level", ColourBy::level}},
      "the transfer function's colours, or one for every process: what it drew, or one for every level");
  addParsed<int>(*command, "--frames", options->frames, "N",
                 fmt::format("a turntable: N pictures, 1 to {}, of a full turn about y, named NAME_0000.png and so on",
                             kMostFrames),
                 [](std::string_view text) { return int(parseWhole(text, 1, kMostFrames)); });
  command
      ->add_option(
          "--progressive", options->progressive,
          "of an attenuation file with levels: also write the pictures that become this one, 00.png and so on, "
          "from the coarsest level on; blocks are taken back and finer ones added, exactly. Pictures of an earlier run "
          "in the folder are removed; any other file named so is an error")
      ->type_name("FOLDER");
  addBackgroundOption(*command, options->picture);
  addCameraOptions(*command, options->camera);
  addLightOptions(*command, options->light);
  addVolumeOptions(*command, options->raw);
  addShareOptions(*command, options->share);
  addCommonOptions(*command, common);
  return {command, [options, command](Session& session) { return render(*options, *command, session); }, true};
}

}  // namespace freevoxel
