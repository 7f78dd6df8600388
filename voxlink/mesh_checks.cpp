#include "voxlink/mesh_checks.h"

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/error.h"
#include "volume/json_reading.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

uint32_t littleAt(std::string_view bytes, size_t offset) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i)
    value |= uint32_t(uint8_t(bytes[offset + i])) << (8 * i);
  return value;
}

/// Lines of a text, those that end in a backslash joined to the next.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  bool next(std::string& line) {
    if (rest_.empty()) return false;
    line.clear();
    number_ = next_;
    for (;;) {
      const size_t end = rest_.find('\n');
      const std::string_view part = trimmed(rest_.substr(0, end));
      rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
      ++next_;
      line += part;
      if (!line.ends_with('\\') || rest_.empty()) return true;
      line.back() = ' ';
    }
  }
  int number() const { return number_; }

 private:
  std::string_view rest_;
  int number_ = 0, next_ = 1;
};

/// What the lines of an OBJ file number, so far.
struct ObjCounts {
  int64_t positions = 0, textures = 0, normals = 0;
  int64_t largestPosition = 0, largestTexture = 0, largestNormal = 0;  ///< that a face names
  int lineOfPosition = 0, lineOfTexture = 0, lineOfNormal = 0;
};

void checkCorner(std::string_view corner, ObjCounts& counts, int line, const std::string& path) {
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}: line {}: {}", path, line, what));
  };
  const std::string_view whole = corner;
  for (int field = 0; field < 3; ++field) {
    const size_t slash = std::min(corner.find('/'), corner.size());
    const std::string_view text = corner.substr(0, slash);
    const bool last = slash == corner.size();
    if (!text.empty() || field == 0) {
      const std::optional<int64_t> number = parseNumber<int64_t>(text);
      if (!number || *number == 0) fail("expected a corner such as 3, 3/1 or 3//2, found " + inQuotes(whole));
      const int64_t there = field == 0 ? counts.positions : field == 1 ? counts.textures : counts.normals;
      if (*number < -there) fail(fmt::format("expected at most {} back, found {}", there, inQuotes(whole)));
      int64_t& largest = field == 0   ? counts.largestPosition
                         : field == 1 ? counts.largestTexture
                                      : counts.largestNormal;
      if (*number > largest) {
        largest = *number;
        (field == 0 ? counts.lineOfPosition : field == 1 ? counts.lineOfTexture : counts.lineOfNormal) = line;
      }
    }
    if (last) return;
    corner.remove_prefix(slash + 1);
  }
  fail("expected at most two slashes in a corner, found " + inQuotes(whole));
}

void checkWholeTextStl(std::string_view text, const std::string& path) {
  std::string line;
  Lines lines(text);
  bool inside = false;  // of solid
  int vertices = -1;    // of the facet; -1 outside facets
  const auto fail = [&](const std::string& what) {
    throw InputError(fmt::format("{}: line {}: {}", path, lines.number(), what));
  };
  while (lines.next(line)) {
    const std::vector<std::string_view> parts = words(line);
    if (parts.empty()) continue;
    const std::string key = lowerCase(parts[0]);
    if (key == "solid") {
      inside = true;
    } else if (key == "facet") {
      vertices = 0;
    } else if (key == "vertex") {
      if (parts.size() != 4 || vertices < 0) fail("expected 'vertex X Y Z' inside a facet");
      for (size_t i = 1; i < 4; ++i) {
        if (!parseNumber<double>(parts[i])) fail("expected a number, found " + inQuotes(parts[i]));
      }
      ++vertices;
    } else if (key == "endfacet") {
      if (vertices != 3) fail(fmt::format("expected a facet of 3 vertices, found {}", std::max(vertices, 0)));
      vertices = -1;
    } else if (key == "endsolid") {
      inside = false;
    } else if (key != "outer" && key != "endloop") {
      fail("expected facet, vertex, endfacet or endsolid, found " + inQuotes(parts[0]));
    }
  }
  if (inside || vertices >= 0) fail("expected 'endsolid', found the end of the file");
}

}  // namespace

uint64_t checkObj(std::string_view text, const std::string& path) {
  ObjCounts counts;
  std::string line;
  Lines lines(text);
  const auto fail = [&](int number, const std::string& what) {
    throw InputError(fmt::format("{}: line {}: {}", path, number, what));
  };
  while (lines.next(line)) {
    const std::vector<std::string_view> parts = words(std::string_view(line).substr(0, line.find('#')));
    if (parts.empty()) continue;
    const std::string_view key = parts[0];
    if (key == "v" || key == "vn" || key == "vt") {
      const size_t least = key == "vt" ? 1 : 3;
      if (parts.size() < 1 + least) {
        fail(lines.number(), fmt::format("expected {} numbers after {}, found {}", least, key, parts.size() - 1));
      }
      for (size_t i = 1; i <= least; ++i) {
        if (!parseNumber<double>(parts[i])) fail(lines.number(), "expected a number, found " + inQuotes(parts[i]));
      }
      ++(key == "v" ? counts.positions : key == "vn" ? counts.normals : counts.textures);
    } else if (key == "f") {
      if (parts.size() < 4) {
        fail(lines.number(), fmt::format("expected a face of at least 3 corners, found {}", parts.size() - 1));
      }
      for (size_t i = 1; i < parts.size(); ++i)
        checkCorner(parts[i], counts, lines.number(), path);
    }
  }
  if (!text.empty() && text.back() != '\n' && !line.empty() && line[0] != '#') {
    fail(lines.number(), "expected an end of the line, found the end of the file: it is cut short");
  }
  const auto checkLargest = [&](int64_t largest, int64_t there, int at, const char* what) {
    if (largest > there) fail(at, fmt::format("expected a {} from 1 to {}, found {}", what, there, largest));
  };
  checkLargest(counts.largestPosition, counts.positions, counts.lineOfPosition, "vertex");
  checkLargest(counts.largestTexture, counts.textures, counts.lineOfTexture, "texture coordinate");
  checkLargest(counts.largestNormal, counts.normals, counts.lineOfNormal, "normal");
  return uint64_t(counts.positions);
}

void checkStl(std::string_view bytes, const std::string& path) {
  constexpr uint64_t kStart = 84, kPerTriangle = 50;
  // Binary files may begin with "solid" too, but their sizes fit.
  const bool hasCount = bytes.size() >= kStart;
  const uint64_t expected = hasCount ? kStart + kPerTriangle * littleAt(bytes, 80) : kStart;
  if (hasCount && bytes.size() == expected) return;
  if (trimmed(bytes.substr(0, 80)).starts_with("solid")) return checkWholeTextStl(bytes, path);
  if (!hasCount) {
    throw InputError(fmt::format("{}: expected an STL file of at least 84 bytes, found {}", path, bytes.size()));
  }
  throw InputError(fmt::format("{}: offset 80: expected {} bytes for {} triangles, found {}", path, expected,
                               littleAt(bytes, 80), bytes.size()));
}

void checkGltf(std::string_view bytes, const std::string& path) {
  std::string_view json = bytes;
  if (bytes.starts_with("glTF")) {
    if (bytes.size() < 20)
      throw InputError(fmt::format("{}: expected at least 20 bytes, found {}", path, bytes.size()));
    const uint32_t version = littleAt(bytes, 4), length = littleAt(bytes, 8), jsonLength = littleAt(bytes, 12);
    if (version != 2) throw InputError(fmt::format("{}: offset 4: expected version 2, found {}", path, version));
    if (length != bytes.size()) {
      throw InputError(fmt::format("{}: offset 8: expected {} bytes, found {}", path, length, bytes.size()));
    }
    if (jsonLength > bytes.size() - 20) {
      throw InputError(
          fmt::format("{}: offset 12: expected {} bytes of JSON, found {}", path, jsonLength, bytes.size() - 20));
    }
    json = bytes.substr(20, jsonLength);
  }
  const nlohmann::json document = parseJson(std::string(json), path);
  const JsonPlace place(document, path);
  const std::string version = place.member("asset").member("version").text();
  if (!version.starts_with("2.")) place.member("asset").member("version").fail("expected version 2, found " + version);
  if (!place.has("extensionsRequired")) return;
  const JsonPlace extensions = place.member("extensionsRequired");
  for (size_t i = 0; i < extensions.size(); ++i) {
    const std::string name = extensions.element(i).text();
    if (name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_") || name.starts_with("KHR_lights_")) {
      continue;
    }
    extensions.element(i).fail(fmt::format("needs the extension {}, which is not understood", name));
  }
}

}  // namespace freevoxel
