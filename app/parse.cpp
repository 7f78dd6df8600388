#include "app/parse.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <vector>

#include "base/grid.h"

namespace freevoxel {

namespace {

UsageError unexpected(std::string_view expected, std::string_view found) {
  return UsageError(fmt::format("expected {}, found '{}'", expected, found));
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <class T>
bool readWhole(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

bool readNumber(std::string_view text, double& value) {
  return readWhole(text, value) && std::isfinite(value);
}

struct NamedColour {
  std::string_view name;
  glm::vec3 srgb;
};
constexpr std::array<NamedColour, 8> kColours{{{"black", {0.0f, 0.0f, 0.0f}},
                                               {"white", {1.0f, 1.0f, 1.0f}},
                                               {"grey", {0.5f, 0.5f, 0.5f}},
                                               {"red", {1.0f, 0.0f, 0.0f}},
                                               {"green", {0.0f, 1.0f, 0.0f}},
                                               {"blue", {0.0f, 0.0f, 1.0f}},
                                               {"yellow", {1.0f, 1.0f, 0.0f}},
                                               {"navy", {0.0f, 0.0f, 0.5f}}}};

}  // namespace

double parseNumber(std::string_view text) {
  double value = 0.0;
  if (!readNumber(text, value)) throw unexpected("a number", text);
  return value;
}

int64_t parseWhole(std::string_view text, int64_t low, int64_t high) {
  int64_t value = 0;
  if (!readWhole(text, value) || value < low || value > high) {
    throw unexpected(fmt::format("a whole number from {} to {}", low, high), text);
  }
  return value;
}

uint64_t parseSeed(std::string_view text) {
  uint64_t value = 0;
  if (!readWhole(text, value)) throw unexpected("a whole number, 0 or more", text);
  return value;
}

glm::dvec3 parseTriple(std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ',');
  glm::dvec3 value(0.0);
  bool good = parts.size() == 3;
  for (int i = 0; good && i < 3; ++i)
    good = readNumber(parts[size_t(i)], value[i]);
  if (!good) throw unexpected("three numbers X,Y,Z", text);
  return value;
}

glm::dvec3 parseSpacing(std::string_view text) {
  const glm::dvec3 value = parseTriple(text);
  if (!(value.x > 0.0 && value.y > 0.0 && value.z > 0.0)) throw unexpected("three lengths above 0", text);
  return value;
}

glm::ivec3 parseDims(std::string_view text) {
  const std::vector<std::string_view> parts = split(text, ',');
  glm::ivec3 value(0);
  bool good = parts.size() == 3;
  for (int i = 0; good && i < 3; ++i)
    good = readWhole(parts[size_t(i)], value[i]);
  if (!good || !validDims(value)) throw unexpected(fmt::format("three sizes X,Y,Z from 1 to {}", kMaxDim), text);
  return value;
}

glm::ivec2 parseImageSize(std::string_view text) {
  constexpr int kMaxSize = 32768;  // as in checkCamera
  const std::vector<std::string_view> parts = split(text, 'x');
  glm::ivec2 value(0);
  if (parts.size() != 2 || !readWhole(parts[0], value.x) || !readWhole(parts[1], value.y) || value.x < 1 ||
      value.y < 1 || value.x > kMaxSize || value.y > kMaxSize) {
    throw unexpected(fmt::format("WIDTHxHEIGHT, each from 1 to {}", kMaxSize), text);
  }
  return value;
}

uint64_t parseBytes(std::string_view text) {
  constexpr std::string_view kUnits = "KMG";
  std::string_view digits = text;
  uint64_t factor = 1;
  if (const size_t unit = text.empty() ? std::string_view::npos : kUnits.find(text.back());
      unit != std::string_view::npos) {
    factor = uint64_t(1) << (10 * (unit + 1));
    digits.remove_suffix(1);
  }
  uint64_t value = 0;
  std::optional<uint64_t> bytes;
  if (readWhole(digits, value)) bytes = checkedProduct(value, factor);
  if (!bytes) throw unexpected("a number of bytes such as 4096, 64K, 500M or 4G", text);
  return *bytes;
}

glm::vec3 parseColour(std::string_view text) {
  const auto named = std::find_if(kColours.begin(), kColours.end(), [&](const auto& c) { return c.name == text; });
  if (named != kColours.end()) return named->srgb;
  const UsageError error = unexpected(fmt::format("#rrggbb, r,g,b from 0 to 1, or one of {}", colourNames()), text);
  if (text.starts_with('#')) {
    uint32_t code = 0;
    const auto [end, problem] = std::from_chars(text.data() + 1, text.data() + text.size(), code, 16);
    if (text.size() != 7 || problem != std::errc() || end != text.data() + text.size()) throw error;
    return glm::vec3(float(code >> 16), float(code >> 8 & 255), float(code & 255)) / 255.0f;
  }
  const std::vector<std::string_view> parts = split(text, ',');
  glm::vec3 colour(0.0f);
  for (size_t i = 0; i < 3; ++i) {
    double channel = 0.0;
    if (parts.size() != 3 || !readNumber(parts[i], channel) || channel < 0.0 || channel > 1.0) throw error;
    colour[int(i)] = float(channel);
  }
  return colour;
}

std::string colourNames() {
  std::string names;
  for (const NamedColour& colour : kColours)
    names += fmt::format("{}{}", names.empty() ? "" : ", ", colour.name);
  return names;
}

}  // namespace freevoxel
