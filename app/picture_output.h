// Pictures as commands write them.
#pragma once

#include <optional>
#include <string>

#include "app/options.h"
#include "app/session.h"
#include "base/image.h"

namespace freevoxel {

struct Background {
  bool transparent = false;
  glm::vec3 srgb{0.0f};
};

/// --output and --background.
struct PictureOptions {
  std::string output;
  std::optional<Background> background;  ///< black for PNG, transparent for EXR unless set
};
void addOutputOption(CLI::App& command, PictureOptions& options);
void addBackgroundOption(CLI::App& command, PictureOptions& options);

Background parseBackground(std::string_view text);

/// Throws UsageError unless the name ends in .png or .exr.
void checkOutputName(const PictureOptions& options);

/// Writes premultiplied linear RGBA. Throws MachineError.
void writePicture(const PictureOptions& options, Image picture, Session& session);

}  // namespace freevoxel
