// freevoxel precompute: from a volume and a transfer function to an attenuation file.
#include "precompute/precompute.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "app/command.h"
#include "app/parse.h"
#include "app/precompute_report.h"
#include "volume/read_volume.h"
#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

struct PrecomputeCommandOptions {
  std::string input, output, transfer;
  VolumeOptions raw;
  std::optional<uint64_t> memory;
  PrecomputeOptions precompute;
};

/// Of --memory, what the program takes beside the volume: libraries, threads' stacks, tables.
constexpr uint64_t kProgramBytes = uint64_t(128) << 20;

uint64_t parseMemory(std::string_view text) {
  constexpr uint64_t kLeast = uint64_t(64) << 20;
  const uint64_t bytes = parseBytes(text);
  if (bytes < kLeast) throw UsageError(fmt::format("expected at least 64M, found '{}'", text));
  return bytes;
}

/// Between two labels there is nothing to integrate.
Classification labelClassification(const PrecomputeCommandOptions& options, const CLI::App& command) {
  const bool asked = command.get_option("--classification")->count() > 0;
  if (asked && options.precompute.classification == Classification::preintegrated) {
    throw UsageError("--classification preintegrated interpolates between values, which labels do not allow");
  }
  return Classification::voxel;
}

Outcome precomputeCommand(PrecomputeCommandOptions options, const CLI::App& command, Session& session) {
  options.precompute.command = session.command();
  const auto classify = [&](const TransferFunction& transfer) {
    if (transfer.isLabels) options.precompute.classification = labelClassification(options, command);
  };
  if (options.memory) {
    options.precompute.memoryBytes = *options.memory - std::min(*options.memory / 2, kProgramBytes);
    const auto source = openVolume(options.input, options.raw);
    const TransferFunction transfer = chooseTransfer(options.transfer, source->header());
    classify(transfer);
    reportPrecompute(precompute(*source, transfer, options.output, options.precompute, session.progress()), session);
    return Outcome::done;
  }
  const Volume volume = session.timed("read", [&] { return readVolume(options.input, options.raw); });
  const TransferFunction transfer = chooseTransfer(options.transfer, volume);
  classify(transfer);
  reportPrecompute(precompute(volume, transfer, options.output, options.precompute, session.progress()), session);
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
  addParsed(
      *command, "--memory", options->memory, "BYTES",
      "take no more memory than this, 64M or more, for the whole run: the volume is read in slices, and its codes "
      "wait on the disk beside the output; K, M and G are powers of 1024 (default: the volume is held in memory)",
      parseMemory);
  addVolumeOptions(*command, options->raw);
  addCommonOptions(*command, common);
  return {command, [options, command](Session& session) { return precomputeCommand(*options, *command, session); }};
}

}  // namespace freevoxel
