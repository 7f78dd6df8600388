// freevoxel verify: is every byte of a file as it was written?
#include <fmt/core.h>

#include <memory>

#include "app/command.h"
#include "app/input_file.h"
#include "hierarchy/attenuation_file.h"
#include "volume/read_volume.h"

namespace freevoxel {

namespace {

struct VerifyOptions {
  std::string input;
  VolumeOptions raw;
};

Outcome verify(const VerifyOptions& options, Session& session) {
  uint64_t bytes = 0;
  if (isAttenuationFile(options.input)) {
    if (hasVolumeOptions(options.raw)) throw UsageError("options for raw volumes make no sense for an .fvx file");
    session.timed("verify", [&] {
      const AttenuationFile file(options.input);
      file.verify();
      bytes = file.fileBytes();
    });
    fmt::print("{}: ok, {} bytes, every checksum matches\n", options.input, bytes);
  } else {
    const Volume volume = session.timed("verify", [&] { return readVolume(options.input, options.raw); });
    bytes = fileBytes(options.input);
    fmt::print("{}: ok, all {} values are there\n", options.input, volume.header.voxels());
  }
  session.statistics["fileBytes"] = bytes;
  return Outcome::done;
}

}  // namespace

Command addVerify(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<VerifyOptions>();
  CLI::App* command = addSubcommand(program, "verify", "check every byte of an attenuation file or a volume",
                                    "freevoxel verify cloud.fvx");
  command->add_option("FILE", options->input, "an attenuation file (checksums) or a volume (complete)")->required();
  addVolumeOptions(*command, options->raw);
  addCommonOptions(*command, common);
  return {command, [options](Session& session) { return verify(*options, session); }};
}

}  // namespace freevoxel
