// freevoxel sheet: pictures side by side.
#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "app/command.h"
#include "app/input_file.h"
#include "base/error.h"
#include "base/image.h"

namespace freevoxel {

namespace {

struct SheetOptions {
  std::vector<std::string> inputs;
  std::string output;
  int columns = 4;
  int gap = 4;
};

constexpr int kMostColumns = 1000, kMostGap = 1000, kMostPixels = 32768;

/// Pictures in rows from the upper left, each in the middle of a place that holds the largest of them, over black.
Outcome sheet(const SheetOptions& options, Session& session) {
  if (lowerCaseExtension(options.output) != "png") {
    throw UsageError(fmt::format("--output: expected a name ending in .png, found '{}'", options.output));
  }
  std::vector<Image> pictures;
  glm::ivec2 place(0);
  for (const std::string& path : options.inputs) {
    pictures.push_back(session.timed("read", [&] { return readImage(path); }));
    if (pictures.back().channels != 3 && pictures.back().channels != 4) {
      throw InputError(
          fmt::format("{}: expected a picture of 3 or 4 channels, found {}", path, pictures.back().channels));
    }
    place = glm::ivec2(std::max(place.x, pictures.back().size.x), std::max(place.y, pictures.back().size.y));
  }
  const int columns = std::min(options.columns, int(pictures.size()));
  const int rows = (int(pictures.size()) + columns - 1) / columns;
  const int64_t width = int64_t(columns) * (place.x + options.gap) - options.gap;
  const int64_t height = int64_t(rows) * (place.y + options.gap) - options.gap;
  if (width > kMostPixels || height > kMostPixels) {
    throw InputError(fmt::format("{}: a sheet of {} x {} pixels would be larger than {}; make the pictures smaller",
                                 options.output, width, height, kMostPixels));
  }
  Image all(glm::ivec2(int(width), int(height)), 4);
  for (size_t i = 0; i < all.pixels.size(); i += 4)
    all.pixels[i + 3] = 1.0f;
  for (size_t i = 0; i < pictures.size(); ++i) {
    const Image& picture = pictures[i];
    const glm::ivec2 cell(int(i) % columns, int(i) / columns);
    const glm::ivec2 corner = cell * (place + options.gap) + (place - picture.size) / 2;
    for (int y = 0; y < picture.size.y; ++y) {
      for (int x = 0; x < picture.size.x; ++x)
        std::copy_n(picture.at(x, y), 3, all.at(corner.x + x, corner.y + y));  // premultiplied: over black already
    }
  }
  session.timed("write", [&] { writePng(options.output, all, session.imageMetadata()); });
  return Outcome::done;
}

}  // namespace

Command addSheet(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<SheetOptions>();
  CLI::App* command = addSubcommand(program, "sheet", "put pictures side by side",
                                    "freevoxel sheet front.png side.png top.png --columns 3 -o sheet.png");
  command->add_option("IMAGE", options->inputs, "PNG or EXR, in rows from the upper left")->required();
  command->add_option("-o,--output", options->output, "the sheet, over black")->type_name("FILE.png")->required();
  addParsed<int>(*command, "--columns", options->columns, "N",
                 fmt::format("pictures in a row, 1 to {} (default {})", kMostColumns, options->columns),
                 [](std::string_view text) { return int(parseWhole(text, 1, kMostColumns)); });
  addParsed<int>(*command, "--gap", options->gap, "PIXELS",
                 fmt::format("black between two pictures, 0 to {} (default {})", kMostGap, options->gap),
                 [](std::string_view text) { return int(parseWhole(text, 0, kMostGap)); });
  addCommonOptions(*command, common);
  return {command, [options](Session& session) { return sheet(*options, session); }};
}

}  // namespace freevoxel
