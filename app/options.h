// Options that several commands share, each declared once.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/parse.h"
#include "base/camera.h"
#include "volume/read_volume.h"

namespace freevoxel {

/// An option with one value that `parse` reads; a UsageError of its is given the option's name.
template <class T>
CLI::Option* addParsed(CLI::App& command, const std::string& names, T& target, const std::string& placeholder,
                       const std::string& description, std::function<T(std::string_view)> parse) {
  const std::string name = names.substr(names.find("--") == std::string::npos ? 0 : names.find("--"));
  const auto read = [&target, name, parse = std::move(parse)](const std::string& text) {
    try {
      target = parse(text);
    } catch (const UsageError& error) {
      throw UsageError(name + ": " + error.what());
    }
  };
  return command.add_option_function<std::string>(names, read, description)->type_name(placeholder);
}

/// As above into an optional.
template <class T>
CLI::Option* addParsed(CLI::App& command, const std::string& names, std::optional<T>& target,
                       const std::string& placeholder, const std::string& description, T (*parse)(std::string_view)) {
  return addParsed<std::optional<T>>(command, names, target, placeholder, description,
                                     [parse](std::string_view text) { return std::optional<T>(parse(text)); });
}

/// An option that takes one of several words; the description is given the default, which is what `target` holds.
template <class T>
CLI::Option* addChoice(CLI::App& command, const std::string& name, T& target,
                       const std::vector<std::pair<std::string, T>>& choices, const std::string& description) {
  std::string words, current;
  for (const auto& [word, value] : choices) {
    words += (words.empty() ? "" : "|") + word;
    if (value == target) current = word;
  }
  const auto parse = [choices, words](std::string_view text) {
    for (const auto& [word, value] : choices) {
      if (word == text) return value;
    }
    throw UsageError("expected " + words + ", found '" + std::string(text) + "'");
  };
  return addParsed<T>(command, name, target, words, description + " (default " + current + ")", parse);
}

/// Options that every command has.
struct CommonOptions {
  std::optional<int> threads;  ///< every core unless set
  bool quiet = false;          ///< no progress, no warnings
  std::string statisticsPath;  ///< empty: no statistics
};
void addCommonOptions(CLI::App& command, CommonOptions& options);

/// Options for files that are nothing but numbers, and for those that hold more than one volume. `--spacing` works for
/// every format.
void addVolumeOptions(CLI::App& command, VolumeOptions& options);

/// --transfer: a file or the name of a preset. `note` ends the description.
CLI::Option* addTransferOption(CLI::App& command, std::string& target, const std::string& note = "");

/// Whether one of them was given.
bool hasVolumeOptions(const VolumeOptions& options);

/// Where the picture is taken from. Without --eye the camera is on an orbit round the volume.
struct CameraOptions {
  struct OrbitDegrees {
    double azimuth = 30.0, elevation = 20.0;
    std::optional<double> distance;  ///< world lengths; framed to fit unless set
  };
  std::optional<OrbitDegrees> orbit;
  std::optional<glm::dvec3> eye, target, up;  ///< world
  double fovDegrees = 30.0;                   ///< vertical
  std::optional<double> orthographicHeight;   ///< world length; 0: framed to fit
  glm::ivec2 imageSize{1000, 1000};
};
void addCameraOptions(CLI::App& command, CameraOptions& options);

/// The camera they describe for something that fills `box`. Throws UsageError or InputError.
Camera makeCamera(const CameraOptions& options, const Box& box);

}  // namespace freevoxel
