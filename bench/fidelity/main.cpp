// Measures how far pictures and shadows are from ray casting, and writes the tables of docs/results.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>

#include "base/error.h"
#include "bench/fidelity/figures.h"
#include "bench/fidelity/tables.h"

namespace freevoxel::bench {

namespace {

struct Options {
  std::string what;
  TableOptions tables;
  std::vector<std::string> columns;
  std::string output;
};

void forEachScene(const Options& options, const std::function<void(const Scene&)>& use) {
  for (const SceneSource& source : sceneSources()) {
    if (!options.columns.empty() &&
        std::find(options.columns.begin(), options.columns.end(), source.name) == options.columns.end()) {
      continue;
    }
    const std::unique_ptr<Scene> scene = loadScene(source, options.tables.folders);
    if (!scene) {
      fmt::print(stderr, "{}: {}/{} is not there, left out\n", source.name, options.tables.folders.data, source.file);
      continue;
    }
    fmt::print(stderr, "{}: {}\n", options.what, source.title);
    use(*scene);
  }
}

void write(const Options& options, const std::string& text) {
  if (options.output.empty()) {
    fmt::print("{}", text);
    return;
  }
  std::ofstream file(options.output);
  file << text;
  if (!file.flush()) throw MachineError(fmt::format("{}: cannot be written", options.output));
}

/// After every scene, so that a run that is cut short leaves what it has.
void measureQuality(const Options& options) {
  QualityTables tables;
  std::string text;
  forEachScene(options, [&](const Scene& scene) {
    addQuality(tables, scene, options.tables);
    text = fmt::format(
        "{} views of {} x {}, PSNR in dB, in brackets the worst view. Against the post-classified reference:\n\n{}\n"
        "Against the pre-classified reference:\n\n{}\nBars, pooled PSNR against the post-classified reference:\n\n{}",
        options.tables.views, options.tables.imageSize.x, options.tables.imageSize.y, tables.post.markdown(),
        tables.pre.markdown(), tables.bars.markdown());
    if (!options.output.empty()) write(options, text);
  });
  if (options.output.empty()) write(options, text);
}

void measure(const Options& options) {
  if (options.what == "quality") return measureQuality(options);
  if (options.what == "references")
    return forEachScene(options, [&](const Scene& scene) { castReferences(scene, options.tables); });
  const std::pair<const char*, void (*)(Table&, const Scene&, const TableOptions&)> simple[] = {
      {"shadows", addShadows}, {"inside", addInside}, {"hidden", addHidden}, {"lights", addLights}};
  for (const auto& [name, add] : simple) {
    if (options.what != name) continue;
    Table table;
    forEachScene(options, [&, add = add](const Scene& scene) { add(table, scene, options.tables); });
    return write(options, table.markdown());
  }
  throw InternalError("internal error: unknown table");
}

int run(int argc, char** argv) {
  CLI::App app("measures the fidelity of freevoxel's pictures");
  Options options;
  int size = options.tables.imageSize.x;
  app.add_option("TABLE", options.what, "what to measure; figures: what to draw; references: casts those of quality")
      ->required()
      ->check(CLI::IsMember({"quality", "shadows", "inside", "hidden", "lights", "figures", "references"}));
  app.add_option("--data", options.tables.folders.data, "folder with the real volumes")->required();
  app.add_option("--transfers", options.tables.folders.transfers, "examples/transfer")->required();
  app.add_option("--cache", options.tables.folders.cache, "folder for references and attenuation files")->required();
  app.add_option("--columns", options.columns, "only these volumes")->delimiter(',');
  app.add_option("--rows", options.tables.rows, "of quality: only rows whose name holds one of these")->delimiter(',');
  app.add_option("--views", options.tables.views, "random views")->check(CLI::Range(1, 1000))->capture_default_str();
  app.add_option("--size", size, "pictures are as many pixels wide and high")
      ->check(CLI::Range(16, 4096))
      ->capture_default_str();
  app.add_option("-o,--output", options.output, "Markdown file (default: stdout); of figures, a folder");
  CLI11_PARSE(app, argc, argv);
  options.tables.imageSize = glm::ivec2(size);
  std::filesystem::create_directories(options.tables.folders.cache);
  if (options.what == "figures") {
    if (options.output.empty()) throw InputError("figures: --output must name a folder");
    drawFigures(options.output, options.tables.folders);
    return 0;
  }
  measure(options);
  return 0;
}

}  // namespace

}  // namespace freevoxel::bench

int main(int argc, char** argv) {
  try {
    return freevoxel::bench::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "freevoxel_fidelity: {}\n", error.what());
    return 1;
  }
}
