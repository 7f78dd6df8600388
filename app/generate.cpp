// freevoxel generate: volumes made by formula.
#include <fmt/format.h>

#include <memory>

#include "app/command.h"
#include "app/input_file.h"
#include "base/atomic_file.h"
#include "volume/procedural.h"
#include "volume/read_volume.h"

namespace freevoxel {

namespace {

struct GenerateOptions {
  std::string kind;
  std::optional<glm::ivec3> dims;
  std::string output;
  std::optional<glm::dvec3> spacing;
  uint64_t seed = 1;
  bool compress = false;
};

void writeRaw(const std::string& path, const Volume& volume) {
  AtomicFile file(path);
  file.reserve(volume.data.size());
  file.writeAt(0, volume.data);
  file.commit();
}

Outcome generate(const GenerateOptions& options, Session& session) {
  const std::string extension = lowerCaseExtension(options.output);
  if (extension != "nrrd" && extension != "raw") {
    throw UsageError(fmt::format("--output: expected a name ending in .nrrd or .raw, found '{}'", options.output));
  }
  if (extension == "raw" && (options.compress || options.spacing)) {
    throw UsageError("--compress and --spacing need a .nrrd file, which can hold them");
  }
  Volume volume = session.timed("generate", [&] { return generateVolume(options.kind, *options.dims, options.seed); });
  if (options.spacing) volume.header.placement.spacing = *options.spacing;
  session.timed("write", [&] {
    if (extension == "raw") {
      writeRaw(options.output, volume);
    } else {
      writeNrrd(options.output, volume, options.compress);
    }
  });
  session.statistics["voxels"] = volume.header.voxels();
  session.statistics["fileBytes"] = fileBytes(options.output);
  return Outcome::done;
}

}  // namespace

Command addGenerate(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<GenerateOptions>();
  CLI::App* command = addSubcommand(program, "generate", "make a volume by formula",
                                    "freevoxel generate cloud --dims 160,128,96 -o cloud.nrrd");
  std::string kinds = "one of";
  for (const ProceduralKind& kind : proceduralKinds()) {
    kinds += fmt::format("\n{} ({}): {}", kind.name, valueTypeName(kind.type), kind.description);
  }
  const auto parseKind = [](std::string_view text) {
    std::string names;
    for (const ProceduralKind& kind : proceduralKinds()) {
      if (kind.name == text) return kind.name;
      names += (names.empty() ? "" : ", ") + kind.name;
    }
    throw UsageError(fmt::format("expected one of {}, found '{}'", names, text));
  };
  addParsed<std::string>(*command, "KIND", options->kind, "KIND", kinds, parseKind)->required();
  addParsed(*command, "--dims", options->dims, "X,Y,Z", fmt::format("voxels along each axis, 1 to {}", kMaxDim),
            parseDims)
      ->required();
  command->add_option("-o,--output", options->output, "the volume to write")
      ->type_name("FILE.nrrd|FILE.raw")
      ->required();
  addParsed(*command, "--spacing", options->spacing, "SX,SY,SZ",
            "lengths of a voxel's edges, each above 0 (default 1,1,1)", parseSpacing);
  addParsed<uint64_t>(*command, "--seed", options->seed, "N",
                      fmt::format("seed of the kinds that have noise, 0 or more (default {})", options->seed),
                      parseSeed);
  command->add_flag("--compress", options->compress, "write gzip-encoded NRRD");
  addCommonOptions(*command, common);
  return {command, [options](Session& session) { return generate(*options, session); }};
}

}  // namespace freevoxel
