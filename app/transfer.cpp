// freevoxel transfer: what a transfer function does to a volume, as a picture or as JSON.
#include <fmt/core.h>

#include <memory>

#include "app/command.h"
#include "app/input_file.h"
#include "base/atomic_file.h"
#include "base/image.h"
#include "volume/read_volume.h"
#include "volume/transfer_plot.h"
#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

struct TransferOptions {
  std::string input, output;
  std::string transfer = "auto";
  VolumeOptions volume;
  glm::ivec2 size{900, 420};
};

void writeText(const std::string& path, const std::string& text) {
  AtomicFile file(path);
  file.writeAt(0, std::as_bytes(std::span(text)));
  file.commit();
}

Outcome transferCommand(const TransferOptions& options, Session& session) {
  const std::string extension = lowerCaseExtension(options.output);
  if (extension != "png" && extension != "json") {
    throw UsageError(fmt::format("--output: expected a name ending in .png or .json, found '{}'", options.output));
  }
  if (options.size.x < 200 || options.size.y < 120) {
    throw UsageError(fmt::format("--size: expected at least 200x120, found {}x{}", options.size.x, options.size.y));
  }
  const Volume volume = session.timed("read", [&] { return readVolume(options.input, options.volume); });
  const TransferFunction transfer = session.timed("choose", [&] { return chooseTransfer(options.transfer, volume); });
  session.statistics["voxels"] = volume.header.voxels();
  session.timed("write", [&] {
    if (extension == "json") {
      writeText(options.output, transferFunctionJson(transfer));
    } else {
      const Histogram histogram = histogramOf(volume, 1024);
      writePng(options.output, transferPlot(transfer, histogram, options.size), session.imageMetadata());
    }
  });
  return Outcome::done;
}

}  // namespace

Command addTransfer(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<TransferOptions>();
  CLI::App* command = addSubcommand(program, "transfer", "draw a transfer function over the histogram of a volume",
                                    "freevoxel transfer head.nii.gz --transfer auto -o head.json");
  command->add_option("VOLUME", options->input, "the volume whose values it is for")->required();
  addTransferOption(*command, options->transfer, " (default auto)");
  command
      ->add_option("-o,--output", options->output,
                   "PNG: bars are the histogram (logarithmic), the curve is opacity; JSON: the function, to be edited")
      ->type_name("FILE.png|FILE.json")
      ->required();
  addParsed<glm::ivec2>(
      *command, "--size", options->size, "WxH",
      fmt::format("size of the PNG in pixels, 200x120 or more (default {}x{})", options->size.x, options->size.y),
      parseImageSize);
  addVolumeOptions(*command, options->volume);
  addCommonOptions(*command, common);
  return {command, [options](Session& session) { return transferCommand(*options, session); }};
}

}  // namespace freevoxel
