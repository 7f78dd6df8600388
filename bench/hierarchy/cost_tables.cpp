#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>
#include <vector>

#include "base/compare.h"
#include "bench/hierarchy/tables.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

/// A frame: of several, that of the median time.
struct Timed {
  Image picture;
  SplatStatistics statistics;
  double seconds = 0.0;
};

Timed timed(Splatter& splatter, const Camera& view, const SplatOptions& options, int repeats) {
  std::vector<Timed> frames;
  // The first fills caches and does not count.
  for (int repeat = 0; repeat <= repeats; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    const SplatResult drawn = splatter.render(view, options, silentProgress());
    Image picture = resolve(drawn.sums, Formula::normalised);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (repeat > 0) frames.push_back({std::move(picture), drawn.statistics, seconds});
  }
  const auto middle = frames.begin() + ptrdiff_t(frames.size() / 2);
  std::nth_element(frames.begin(), middle, frames.end(),
                   [](const Timed& a, const Timed& b) { return a.seconds < b.seconds; });
  return std::move(*middle);
}

std::string blocksText(const SplatStatistics& statistics) {
  std::string text;
  for (const uint64_t blocks : statistics.blocksOfLevel)
    text += fmt::format("{}{}", text.empty() ? "" : " + ", blocks);
  return text;
}

SplatOptions detail(double pixels) {
  SplatOptions options;
  options.lodPixels = pixels;
  return options;
}

std::string dimsText(glm::ivec3 dims) {
  return fmt::format("{} x {} x {}", dims.x, dims.y, dims.z);
}

Camera viewOf(const AttenuationFile& file, int imageSize) {
  return randomViews(worldBounds(file.placement(), file.dims()), 1, glm::ivec2(imageSize)).front();
}

}  // namespace

void addDetail(Table& table, const Scene& scene, const TableOptions& options) {
  if (table.head.empty())
    table.head = {"volume", "--lod", "PSNR against --lod 0, dB", "frame, ms", "of it blocks", "blocks by level"};
  const AttenuationFile file = levelFile(scene, Hierarchy::geometric, 0, options.folders);
  Splatter splatter(file, scene.transfer, Backend::cpu);
  const Camera view = viewOf(file, options.imageSize);
  Image finest;
  for (const double pixels : {0.0, 0.5, 1.0, 2.0, 4.0, 8.0}) {
    Timed drawn = timed(splatter, view, detail(pixels), options.repeats);
    if (pixels == 0.0) finest = drawn.picture;
    table.rows.push_back({scene.source.title, fmt::format("{}", pixels),
                          pixels == 0.0 ? "" : fmt::format("{:.1f}", compareImages(drawn.picture, finest).psnr),
                          fmt::format("{:.0f}", 1000.0 * drawn.seconds),
                          fmt::format("{:.0f}", 1000.0 * drawn.statistics.drawSeconds), blocksText(drawn.statistics)});
    fmt::print(stderr, "{}\n", fmt::join(table.rows.back(), " | "));
  }
  std::filesystem::remove(file.path());
}

void addVolumeSize(Table& table, const std::string& path, const TableOptions& options) {
  if (table.head.empty()) {
    table.head = {"volume",           "file, MB",        "--lod 1, ms",           "of it blocks",
                  "of the first row", "blocks by level", "memory for bricks, MB", "PSNR against --lod 0, dB"};
  }
  const AttenuationFile file(path);
  Splatter splatter(file, file.transfer(), Backend::cpu);
  const Camera view = viewOf(file, options.imageSize);
  const Timed drawn = timed(splatter, view, detail(1.0), options.repeats);
  const double first = table.rows.empty() ? drawn.seconds : std::stod(table.rows.front()[2]) / 1000.0;
  std::vector<std::string> row = {dimsText(file.dims()),
                                  fmt::format("{:.1f}", double(file.fileBytes()) / 1e6),
                                  fmt::format("{:.1f}", 1000.0 * drawn.seconds),
                                  fmt::format("{:.1f}", 1000.0 * drawn.statistics.drawSeconds),
                                  fmt::format("x {:.2f}", drawn.seconds / first),
                                  blocksText(drawn.statistics),
                                  fmt::format("{:.1f}", double(drawn.statistics.volumeBytes) / 1e6)};
  const Image finest = resolve(splatter.render(view, detail(0.0), silentProgress()).sums, Formula::normalised);
  row.push_back(fmt::format("{:.1f}", compareImages(drawn.picture, finest).psnr));
  fmt::print(stderr, "{}\n", fmt::join(row, " | "));
  table.rows.push_back(std::move(row));
}

void addImageSize(Table& table, const std::string& path, const TableOptions& options) {
  if (table.head.empty()) table.head = {"volume", "image", "--lod 1, ms", "of it blocks", "blocks by level"};
  const AttenuationFile file(path);
  Splatter splatter(file, file.transfer(), Backend::cpu);
  for (const int size : {128, 256, 512, 1024}) {
    const Timed drawn = timed(splatter, viewOf(file, size), detail(1.0), options.repeats);
    table.rows.push_back({dimsText(file.dims()), fmt::format("{} x {}", size, size),
                          fmt::format("{:.1f}", 1000.0 * drawn.seconds),
                          fmt::format("{:.1f}", 1000.0 * drawn.statistics.drawSeconds), blocksText(drawn.statistics)});
    fmt::print(stderr, "{}\n", fmt::join(table.rows.back(), " | "));
  }
}

}  // namespace freevoxel::bench
