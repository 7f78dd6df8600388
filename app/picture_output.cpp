#include "app/picture_output.h"

#include <fmt/core.h>

#include "app/input_file.h"
#include "app/parse.h"
#include "splat/sums.h"

namespace freevoxel {

Background parseBackground(std::string_view text) {
  if (text == "transparent") return {true, glm::vec3(0.0f)};
  return {false, parseColour(text)};
}

void addOutputOption(CLI::App& command, PictureOptions& options) {
  command
      .add_option("-o,--output", options.output,
                  "the picture: PNG is sRGB, 8 bits; EXR is linear, premultiplied, 32 bits, with alpha")
      ->type_name("FILE.png|FILE.exr")
      ->required();
}

void addBackgroundOption(CLI::App& command, PictureOptions& options) {
  addParsed(command, "--background", options.background, "COLOUR",
            "sRGB: #rrggbb, r,g,b from 0 to 1, transparent, or one of " + colourNames() +
                " (default: black for PNG, transparent for EXR)",
            parseBackground);
}

void checkOutputName(const PictureOptions& options) {
  const std::string extension = lowerCaseExtension(options.output);
  if (extension != "png" && extension != "exr") {
    throw UsageError(fmt::format("--output: expected a name ending in .png or .exr, found '{}'", options.output));
  }
}

void writePicture(const PictureOptions& options, Image picture, Session& session) {
  const std::vector<std::string> channels = {"R", "G", "B", "A"};
  const bool png = lowerCaseExtension(options.output) == "png";
  const bool transparent = options.background ? options.background->transparent : !png;
  if (!transparent) {
    const glm::vec3 srgb = options.background ? options.background->srgb : glm::vec3(0.0f);
    picture =
        overBackground(picture, glm::vec3(linearFromSrgb(srgb.r), linearFromSrgb(srgb.g), linearFromSrgb(srgb.b)));
  }
  session.timed("write", [&] {
    if (png) {
      writePng(options.output, picture, session.imageMetadata(), transparent);
    } else {
      writeExr(options.output, picture, channels, session.imageMetadata());
    }
  });
}

}  // namespace freevoxel
