#include "app/level_options.h"

#include "app/options.h"
#include "app/parse.h"
#include "base/error.h"

namespace freevoxel {

namespace {

double parsePixels(std::string_view text) {
  const double pixels = parseNumber(text);
  if (!(pixels >= 0.0 && pixels <= 1e6)) throw UsageError(fmt::format("expected 0 to 1000000, found {}", text));
  return pixels;
}

uint64_t parseSomeMemory(std::string_view text) {
  constexpr uint64_t kLeast = uint64_t(1) << 20;
  const uint64_t bytes = parseBytes(text);
  if (bytes < kLeast) throw UsageError(fmt::format("expected at least 1M, found '{}'", text));
  return bytes;
}

}  // namespace

void addLevelOptions(CLI::App& command, SplatOptions& options) {
  addParsed<double>(command, "--lod", options.lodPixels, "PIXELS",
                    "draw blocks of an attenuation file at the coarsest level whose voxels are no larger than this on "
                    "the image; 0 for the finest (default 0)",
                    parsePixels);
  addParsed<uint64_t>(command, "--gpu-memory", options.gpuMemoryBytes, "BYTES",
                      "the most that OpenGL's buffers and textures may take, e.g. 64M; blocks stream through them "
                      "(default: as much as is useful). The bits are the same",
                      parseSomeMemory);
  addParsed<uint64_t>(
      command, "--memory", options.memoryBytes, "BYTES",
      "the most memory to take, e.g. 1G; bricks of an attenuation file are read again rather than kept "
      "(default: as much as is useful). The program and its libraries take about 180M of it, and OpenGL "
      "more where it runs on the processor. The bits are the same",
      parseSomeMemory);
}

void reportLevels(const SplatStatistics& statistics, Session& session) {
  session.statistics["emptyBlocks"] = statistics.emptyBlocks;
  session.statistics["blocksOfLevel"] = statistics.blocksOfLevel;
  session.statistics["splatsOfLevel"] = statistics.splatsOfLevel;
  session.statistics["volumeBytes"] = statistics.volumeBytes;
  if (statistics.glBytes > 0) session.statistics["glBytes"] = statistics.glBytes;
}

}  // namespace freevoxel
