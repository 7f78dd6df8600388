// What readers of a scene file's parts share.
#pragma once

#include <string>

#include "volume/json_reading.h"
#include "volume/read_volume.h"

namespace freevoxel {

/// Places of a scene lie within this of its origin, along every axis.
inline constexpr double kLargestPlace = 1e12;

/// A file's name relative to the scene's folder.
std::string besideScene(const std::string& scene, const std::string& name);
/// The same of a transfer function, which may be a preset.
std::string transferBesideScene(const std::string& scene, const std::string& name);

/// The value that a word stands for; fails if it is none of them.
template <class T>
T oneOf(const JsonPlace& place, std::initializer_list<std::pair<const char*, T>> choices) {
  const std::string found = place.text();
  std::string words;
  for (const auto& [word, value] : choices) {
    if (found == word) return value;
    words += (words.empty() ? "" : ", ") + std::string(word);
  }
  place.fail("expected one of " + words + ", found '" + found + "'");
}

/// dims, type, endian, skip, spacing, component, frame, labels.
VolumeOptions readRawOptions(const JsonPlace& volume);

}  // namespace freevoxel
