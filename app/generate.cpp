// freevoxel generate: volumes made by formula.
#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <span>
#include <vector>

#include "app/command.h"
#include "app/input_file.h"
#include "base/atomic_file.h"
#include "volume/procedural.h"
#include "volume/write_nrrd.h"

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

/// Slices are made and written a few at a time: the volume need not fit memory.
constexpr uint64_t kPortionBytes = uint64_t(64) << 20;

/// Calls write(bytes) with all slices in order.
template <class Write>
void generateInPortions(const GenerateOptions& options, const VolumeHeader& header, Session& session, Write&& write) {
  const uint64_t sliceBytes = header.bytes() / uint64_t(header.dims.z);
  const int portion = int(std::clamp<uint64_t>(kPortionBytes / sliceBytes, 1, uint64_t(header.dims.z)));
  std::vector<std::byte> bytes(uint64_t(portion) * sliceBytes);
  for (int first = 0; first < header.dims.z; first += portion) {
    const int count = std::min(portion, header.dims.z - first);
    const auto part = std::span(bytes).first(uint64_t(count) * sliceBytes);
    session.timed("generate", [&] { generateSlices(options.kind, header.dims, options.seed, first, count, part); });
    session.timed("write", [&] { write(part); });
  }
}

void writeRaw(const GenerateOptions& options, const VolumeHeader& header, Session& session) {
  AtomicFile file(options.output);
  file.reserve(header.bytes());
  uint64_t offset = 0;
  generateInPortions(options, header, session, [&](std::span<const std::byte> bytes) {
    file.writeAt(offset, bytes);
    offset += bytes.size();
  });
  file.commit();
}

void writeNrrdFile(const GenerateOptions& options, const VolumeHeader& header, Session& session) {
  NrrdWriter writer(options.output, header, options.compress);
  generateInPortions(options, header, session, [&](std::span<const std::byte> bytes) { writer.append(bytes); });
  session.timed("write", [&] { writer.finish(); });
}

Outcome generate(const GenerateOptions& options, Session& session) {
  const std::string extension = lowerCaseExtension(options.output);
  if (extension != "nrrd" && extension != "raw") {
    throw UsageError(fmt::format("--output: expected a name ending in .nrrd or .raw, found '{}'", options.output));
  }
  if (extension == "raw" && (options.compress || options.spacing)) {
    throw UsageError("--compress and --spacing need a .nrrd file, which can hold them");
  }
  VolumeHeader header = proceduralHeader(options.kind, *options.dims);
  if (options.spacing) header.placement.spacing = *options.spacing;
  if (extension == "raw") {
    writeRaw(options, header, session);
  } else {
    writeNrrdFile(options, header, session);
  }
  session.statistics["voxels"] = header.voxels();
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
