// Measures what pictures of coarser levels are worth: level k against the finest, low-passed to one pixel per voxel of
// level k (docs/results/hierarchy).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "base/compare.h"
#include "base/error.h"
#include "bench/fidelity/measured.h"
#include "bench/fidelity/scenes.h"
#include "bench/fidelity/table.h"
#include "precompute/precompute.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

constexpr int kLevels = 3;

struct Options {
  Folders folders;
  std::vector<std::string> columns;
  int views = 4;
  std::string output;
};

/// The mean of every square of n x n pixels.
Image lowPassed(const Image& fine, int n) {
  Image result(fine.size / n, fine.channels);
  for (int y = 0; y < result.size.y; ++y) {
    for (int x = 0; x < result.size.x; ++x) {
      for (int channel = 0; channel < fine.channels; ++channel) {
        double sum = 0.0;
        for (int i = 0; i < n * n; ++i)
          sum += double(fine.at(x * n + i % n, y * n + i / n)[channel]);
        result.at(x, y)[channel] = float(sum / (n * n));
      }
    }
  }
  return result;
}

/// Orthographic, and a pixel as large as the longest edge of a voxel of the level.
Camera levelCamera(const Camera& from, const Placement& placement, const Box& bounds, int level) {
  const glm::dvec3 spacing = placement.spacing;
  const double pixel = std::max({spacing.x, spacing.y, spacing.z}) * double(1 << level);
  Camera camera = from;
  const int size = int(std::ceil(glm::length(bounds.extent()) / pixel));
  camera.imageSize = glm::ivec2(size);
  camera.orthographicHeight = size * pixel;
  return camera;
}

AttenuationFile levelFile(const Scene& scene, Hierarchy hierarchy, const Folders& folders) {
  const std::string path = fmt::format("{}/{}-levels-{}-{:016x}.fvx", folders.cache, scene.source.name,
                                       hierarchyName(hierarchy), scene.hash);
  PrecomputeOptions options;
  options.layout = Layout::compact;
  options.levels = kLevels + 1;
  options.hierarchy = hierarchy;
  precompute(scene.volume, scene.transfer, path, options, silentProgress());
  return AttenuationFile(path);
}

void addRows(Table& table, const Scene& scene, const Options& options) {
  for (const Hierarchy hierarchy : {Hierarchy::geometric, Hierarchy::weighted}) {
    const AttenuationFile file = levelFile(scene, hierarchy, options.folders);
    Splatter splatter(file, scene.transfer, Backend::cpu);
    std::vector<std::string> row = {scene.source.title, std::string(hierarchyName(hierarchy))};
    for (int level = 1; level <= kLevels; ++level) {
      Measured measured;
      for (const Camera& view : randomViews(scene.bounds(), options.views, {16, 16})) {
        const Camera coarse = levelCamera(view, scene.grid.placement, scene.bounds(), level);
        Camera fine = coarse;
        fine.imageSize *= 1 << level;
        SplatOptions splat;
        const Image reference = resolve(splatter.render(fine, splat, silentProgress()).sums, Formula::normalised);
        splat.lodPixels = 1.001;  // every block's voxels are one pixel
        const SplatResult result = splatter.render(coarse, splat, silentProgress());
        const std::vector<uint64_t>& blocks = result.statistics.blocksOfLevel;
        if (blocks.size() != size_t(level) + 1) throw InternalError("internal error: another level was drawn");
        measured.add(compareImages(resolve(result.sums, Formula::normalised), lowPassed(reference, 1 << level)));
      }
      row.push_back(measured.text());
    }
    row.push_back(fmt::format("{:.3f}", double(file.levelBytes()) / double(voxelCount(file.dims()))));
    table.rows.push_back(row);
    fmt::print(stderr, "{} {}: {} {} {}\n", row[0], row[1], row[2], row[3], row[4]);
    std::filesystem::remove(file.path());
  }
}

int run(int argc, char** argv) {
  CLI::App app("measures what pictures of coarser levels are worth");
  Options options;
  app.add_option("--data", options.folders.data, "folder with the real volumes")->required();
  app.add_option("--transfers", options.folders.transfers, "examples/transfer")->required();
  app.add_option("--cache", options.folders.cache, "folder for attenuation files while they are needed")->required();
  app.add_option("--columns", options.columns, "only these volumes")->delimiter(',');
  app.add_option("--views", options.views, "random views")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("-o,--output", options.output, "Markdown file (default: stdout)");
  CLI11_PARSE(app, argc, argv);
  std::filesystem::create_directories(options.folders.cache);
  Table table;
  table.head = {"volume", "hierarchy", "level 1", "level 2", "level 3", "bytes of levels per voxel (compact)"};
  for (const SceneSource& source : sceneSources()) {
    if (!options.columns.empty() &&
        std::find(options.columns.begin(), options.columns.end(), source.name) == options.columns.end()) {
      continue;
    }
    const std::unique_ptr<Scene> scene = loadScene(source, options.folders);
    if (!scene) {
      fmt::print(stderr, "{}: {}/{} is not there, left out\n", source.name, options.folders.data, source.file);
      continue;
    }
    addRows(table, *scene, options);
  }
  if (options.output.empty()) {
    fmt::print("{}", table.markdown());
    return 0;
  }
  std::ofstream file(options.output);
  file
      << "# What coarser levels are worth\n\nPSNR in dB (peak 1, linear, covered pixels), pooled over " << options.views
      << " random orthographic views and, in brackets, the worst of them: level k, a pixel to the longest edge of its\n"
         "voxels, against the finest level at 2^k times the size, averaged over 2^k x 2^k pixels. Written by\n"
         "`scripts/reproduce_freevoxels.sh levels`.\n\n"
      << table.markdown();
  if (!file.flush()) throw MachineError(fmt::format("{}: cannot be written", options.output));
  return 0;
}

}  // namespace

}  // namespace freevoxel::bench

int main(int argc, char** argv) {
  try {
    return freevoxel::bench::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "freevoxel_hierarchy: {}\n", error.what());
    return 1;
  }
}
