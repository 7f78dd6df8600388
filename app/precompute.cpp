// freevoxel precompute: from a volume and a transfer function to an attenuation file.
#include "precompute/precompute.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "app/command.h"
#include "app/parse.h"
#include "app/precompute_report.h"
#include "app/program_memory.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "parallel/distributed_precompute.h"
#include "splat/pinned_attenuation.h"
#include "volume/read_volume.h"
#include "volume/resample.h"
#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

struct PrecomputeCommandOptions {
  std::string input, output, transfer;
  VolumeOptions raw;
  std::optional<uint64_t> memory;
  std::optional<int> resolution;
  std::vector<Pin> pins;
  PrecomputeOptions precompute;
};

uint64_t parseMemory(std::string_view text) {
  constexpr uint64_t kLeast = uint64_t(64) << 20;
  const uint64_t bytes = parseBytes(text);
  if (bytes < kLeast) throw UsageError(fmt::format("expected at least 64M, found '{}'", text));
  return bytes;
}

int parseLevels(std::string_view text) {
  const double levels = parseNumber(text);
  if (!(levels >= 0.0 && levels <= 32.0) || levels != std::floor(levels))
    throw UsageError(fmt::format("expected a whole number from 0 to 32, found {}", text));
  return int(levels);
}

/// Between two labels there is nothing to integrate.
Classification labelClassification(const PrecomputeCommandOptions& options, const CLI::App& command) {
  const bool asked = command.get_option("--classification")->count() > 0;
  if (asked && options.precompute.classification == Classification::preintegrated) {
    throw UsageError("--classification preintegrated interpolates between values, which labels do not allow");
  }
  return Classification::voxel;
}

/// One word of --pin-light or --pin-direction.
Pin parsePin(std::string_view text, bool directional) {
  const Pin pin{directional, parseTriple(text)};
  if (directional && pin.world == glm::dvec3(0.0)) throw UsageError("a direction must not be 0,0,0");
  return pin;
}

void addPinOption(CLI::App& command, const std::string& name, std::vector<Pin>& pins, bool directional,
                  const std::string& description) {
  const auto read = [&pins, name, directional](const std::vector<std::string>& texts) {
    for (const std::string& text : texts) {
      try {
        pins.push_back(parsePin(text, directional));
      } catch (const UsageError& error) {
        throw UsageError(name + ": " + error.what());
      }
    }
  };
  command.add_option_function<std::vector<std::string>>(name, read, description)
      ->type_name("X,Y,Z")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

/// Throws MachineError if pins need more memory than is allowed: a sweep has the whole volume before it.
void checkPinMemory(const PrecomputeCommandOptions& options, const VolumeHeader& header) {
  const uint64_t needed = pinMemory(header.voxels());
  if (options.pins.empty() || options.precompute.memoryBytes == 0 || needed <= options.precompute.memoryBytes) return;
  throw MachineError(
      fmt::format("{}: pins need {} bytes of memory for this volume, {} are allowed; try more, or no pins",
                  options.output, needed, options.precompute.memoryBytes));
}

/// The attenuation file, with pins if there are any. `Source` is a Volume or a VolumeSource.
template <class Source>
void makeFile(Source& source, const TransferFunction& transfer, const PrecomputeCommandOptions& options,
              Session& session) {
  if (options.pins.empty()) {
    reportPrecompute(precompute(source, transfer, options.output, options.precompute, session.progress()), session);
    return;
  }
  // Never committed, so it goes when this function ends.
  const AtomicFile scratch(options.output + ".unpinned.fvx");
  PrecomputeResult result =
      precompute(source, transfer, scratch.temporaryPath(), options.precompute, session.progress());
  result.fileBytes = session.timed("pins", [&] {
    return pinAttenuation(scratch.temporaryPath(), options.pins, options.output, session.progress());
  });
  reportPrecompute(result, session);
  session.statistics["pins"] = options.pins.size();
}

Outcome precomputeCommand(PrecomputeCommandOptions options, const CLI::App& command, Session& session) {
  options.precompute.command = session.command();
  const auto classify = [&](const TransferFunction& transfer) {
    if (transfer.isLabels) options.precompute.classification = labelClassification(options, command);
  };
  if (options.memory) options.precompute.memoryBytes = memoryForData(*options.memory);
  if (options.resolution && (options.memory || session.ranks().rankCount() > 1)) {
    throw UsageError("--resolution holds the whole volume in one process: leave --memory and the launcher out");
  }
  if (session.ranks().rankCount() > 1) {
    if (!options.pins.empty()) throw UsageError("pins are swept by one process: precompute without the launcher");
    const auto source = openVolume(options.input, options.raw);
    const TransferFunction transfer = chooseTransfer(options.transfer, source->header());
    classify(transfer);
    reportPrecompute(
        precompute(*source, transfer, options.output, options.precompute, session.ranks(), session.progress()),
        session);
    return Outcome::done;
  }
  if (options.memory) {
    const auto source = openVolume(options.input, options.raw);
    const TransferFunction transfer = chooseTransfer(options.transfer, source->header());
    classify(transfer);
    checkPinMemory(options, source->header());
    makeFile(*source, transfer, options, session);
    return Outcome::done;
  }
  Volume volume = session.timed("read", [&] { return readVolume(options.input, options.raw); });
  const TransferFunction transfer = chooseTransfer(options.transfer, volume);
  classify(transfer);
  if (options.resolution) {
    volume.header.labels = volume.header.labels || transfer.isLabels;
    volume =
        session.timed("resample", [&] { return resampled(volume, resampledDims(volume.header, *options.resolution)); });
  }
  makeFile(volume, transfer, options, session);
  return Outcome::done;
}

}  // namespace

void reportPrecompute(const PrecomputeResult& result, Session& session) {
  session.addSeconds("sweep", result.sweepSeconds);
  session.addSeconds("write", result.writeSeconds);
  session.statistics["voxels"] = result.voxels;
  session.statistics["storedVoxels"] = result.storedVoxels;
  session.statistics["visibleVoxels"] = result.visibleVoxels;
  session.statistics["nonFinite"] = result.nonFinite;
  session.statistics["blocks"] = result.bricks;
  session.statistics["levels"] = result.levels;
  session.statistics["levelBytes"] = result.levelBytes;
  session.statistics["fileBytes"] = result.fileBytes;
  session.statistics["bytesPerVoxel"] = double(result.fileBytes) / double(result.voxels);
  session.statistics["largestValueError"] = result.largestValueError;
  if (result.nonFinite > 0) {
    session.warn(
        fmt::format("{} values are NaN or infinite: NaN and -infinity count as the lowest value of the "
                    "transfer function's range, +infinity as the highest",
                    result.nonFinite));
  }
  if (result.visibleVoxels == 0) session.warn("nothing is visible: the transfer function gives no voxel any opacity");
}

Command addPrecompute(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<PrecomputeCommandOptions>();
  CLI::App* command = addSubcommand(program, "precompute", "make an attenuation file from a volume",
                                    "freevoxel precompute cloud.nrrd --transfer cloud.json -o cloud.fvx");
  command
      ->add_option(
          "VOLUME", options->input,
          "the volume: a file of any format of docs/formats.md, a folder of slices, or raw with the options below")
      ->required();
  addTransferOption(*command, options->transfer)->required();
  command->add_option("-o,--output", options->output, "the attenuation file to write")
      ->type_name("FILE.fvx")
      ->required();
  addChoice<Classification>(*command, "--classification", options->precompute.classification,
                            {{"voxel", Classification::voxel}, {"preintegrated", Classification::preintegrated}},
                            "whether attenuation multiplies voxels or segments between them");
  addChoice<Layout>(*command, "--layout", options->precompute.layout,
                    {{"dense", Layout::dense}, {"compact", Layout::compact}},
                    "how attenuation is stored: all of it, or the faces of bricks, compressed");
  addChoice<int>(*command, "--brick", options->precompute.brickEdge, {{"8", 8}, {"16", 16}, {"32", 32}},
                 "edge of a brick in voxels");
  addParsed<int>(*command, "--levels", options->precompute.levels, "N",
                 "levels of detail, the finest included; 0 for as many as it takes until one brick holds the volume "
                 "(default 1)",
                 parseLevels);
  addChoice<Hierarchy>(*command, "--hierarchy", options->precompute.hierarchy,
                       {{"geometric", Hierarchy::geometric}, {"weighted", Hierarchy::weighted}},
                       "attenuation of a coarser level: the geometric mean of eight voxels, or their mean weighted by "
                       "opacity");
  addParsed(
      *command, "--memory", options->memory, "BYTES",
      "take no more memory than this, 64M or more, for the whole run: the volume is read in slices, and its codes "
      "wait on the disk beside the output; K, M and G are powers of 1024 (default: the volume is held in memory)",
      parseMemory);
  addParsed<std::optional<int>>(
      *command, "--resolution", options->resolution, "N",
      fmt::format("voxels along the longest edge, 1 to {}: the volume is resampled (default: its own)", kMaxDim),
      [](std::string_view text) { return std::optional<int>(int(parseWhole(text, 1, kMaxDim))); });
  addPinOption(
      *command, "--pin-light", options->pins, false,
      "also store attenuation swept towards a point of world space: of a lamp that stays there, or an eye; may "
      "be given again");
  addPinOption(*command, "--pin-direction", options->pins, true,
               "also store attenuation swept towards a direction: of a lamp far away, or parallel rays; may be given "
               "again");
  addVolumeOptions(*command, options->raw);
  addCommonOptions(*command, common);
  return {command, [options, command](Session& session) { return precomputeCommand(*options, *command, session); },
          true};
}

}  // namespace freevoxel
