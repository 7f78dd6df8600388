// Spheres as their files have them, one reader per format.
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>

#include "voxlink/read_spheres.h"

namespace freevoxel {

/// Like SphereFile, but places and radii may be anything, and radii empty: the file has none.
using RawSpheres = SphereFile;

// Each throws InputError with the line or offset.
RawSpheres readCsv(const std::string& path, const SphereOptions& options);
RawSpheres readXyz(const std::string& path, const SphereOptions& options);
RawSpheres readPdb(const std::string& path, const SphereOptions& options);
RawSpheres readNumpySpheres(const std::string& path, const SphereOptions& options);

/// Lines of a text, without their ends.
class TextLines {
 public:
  TextLines(std::string_view text, std::string path) : rest_(text), path_(std::move(path)) {}

  /// False at the end of the text.
  bool next();
  std::string_view line() const { return line_; }
  /// Whether the line has an end: the last one may lack it.
  bool ended() const { return ended_; }
  /// What comes after the line.
  std::string_view rest() const { return rest_; }

  /// Throws InputError with file and line.
  [[noreturn]] void fail(const std::string& what) const;
  /// The number that a word of the line is; `what` names it. Throws InputError: if it is none, or if the file ends with
  /// it, which may have been longer.
  double number(std::string_view word, const std::string& what) const;

 private:
  std::string_view rest_, line_;
  std::string path_;
  int number_ = 0;
  bool ended_ = true;
};

/// The material with a name, made by `make` when it is first asked for.
class MaterialNames {
 public:
  template <class Make>
  uint32_t number(const std::string& name, Spheres& spheres, Make&& make) {
    const auto [entry, isNew] = numbers_.try_emplace(name, uint32_t(spheres.materials.size()));
    if (isNew) spheres.materials.push_back(make());
    return entry->second;
  }

 private:
  std::unordered_map<std::string, uint32_t> numbers_;
};

}  // namespace freevoxel
