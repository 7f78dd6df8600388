// Measures what levels of detail are worth and what they cost (docs/results/hierarchy.md).
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "base/error.h"
#include "bench/hierarchy/tables.h"

namespace freevoxel::bench {

namespace {

struct Options {
  std::string what;
  TableOptions tables;
  std::vector<std::string> columns;
  std::string output;
};

void forEachScene(const Options& options, Table& table, void (*add)(Table&, const Scene&, const TableOptions&)) {
  for (const SceneSource& source : sceneSources()) {
    if (!options.columns.empty() &&
        std::find(options.columns.begin(), options.columns.end(), source.name) == options.columns.end()) {
      continue;
    }
    const std::unique_ptr<Scene> scene = loadScene(source, options.tables.folders);
    if (scene) {
      add(table, *scene, options.tables);
    } else {
      fmt::print(stderr, "{}: {}/{} is not there, left out\n", source.name, options.tables.folders.data, source.file);
    }
  }
}

Table measured(const Options& options) {
  Table table;
  if (options.what == "levels") forEachScene(options, table, addLevels);
  if (options.what == "refinement") forEachScene(options, table, addRefinement);
  if (options.what == "detail") forEachScene(options, table, addDetail);
  for (const std::string& file : options.tables.files) {
    if (options.what == "volume-size") addVolumeSize(table, file, options.tables);
    if (options.what == "image-size") addImageSize(table, file, options.tables);
  }
  return table;
}

int run(int argc, char** argv) {
  CLI::App app("measures what levels of detail are worth and what they cost");
  Options options;
  app.add_option("TABLE", options.what, "what to measure")
      ->required()
      ->check(CLI::IsMember({"levels", "refinement", "detail", "volume-size", "image-size"}));
  app.add_option("--data", options.tables.folders.data, "folder with the real volumes");
  app.add_option("--transfers", options.tables.folders.transfers, "examples/transfer");
  app.add_option("--cache", options.tables.folders.cache, "folder for attenuation files while they are needed");
  app.add_option("--columns", options.columns, "only these volumes")->delimiter(',');
  app.add_option("--files", options.tables.files, "of volume-size and image-size: attenuation files")->delimiter(',');
  app.add_option("--views", options.tables.views, "random views")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--size", options.tables.imageSize, "pixels along an edge of pictures")
      ->check(CLI::Range(1, 8192))
      ->capture_default_str();
  app.add_option("-o,--output", options.output, "Markdown file (default: stdout)");
  CLI11_PARSE(app, argc, argv);
  if (!options.tables.folders.cache.empty()) std::filesystem::create_directories(options.tables.folders.cache);
  const std::string text = measured(options).markdown();
  if (options.output.empty()) {
    fmt::print("{}", text);
    return 0;
  }
  std::ofstream file(options.output);
  file << text;
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
