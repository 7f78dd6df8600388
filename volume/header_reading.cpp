#include "volume/header_reading.h"

#include <cmath>
#include <filesystem>

#include "base/error.h"
#include "base/grid.h"
#include "volume/text_parsing.h"

namespace freevoxel {

void HeaderFields::fail(int line, const std::string& what) const {
  throw InputError(fmt::format("{}: line {}: {}", path, line, what));
}

const HeaderField* HeaderFields::find(const std::string& name) const {
  const auto found = fields.find(name);
  return found == fields.end() ? nullptr : &found->second;
}

const HeaderField* HeaderFields::findAny(std::initializer_list<const char*> names) const {
  for (const char* name : names) {
    if (const HeaderField* field = find(name)) return field;
  }
  return nullptr;
}

const HeaderField& HeaderFields::need(const std::string& name) const {
  if (const HeaderField* field = find(name)) return *field;
  throw InputError(fmt::format("{}: the header has no field '{}'", path, name));
}

std::vector<double> HeaderFields::numbers(const HeaderField& field, size_t count) const {
  const std::vector<std::string_view> parts = words(field.text);
  std::vector<double> values;
  for (const std::string_view part : parts) {
    const double value = parseNumber<double>(lowerCase(part)).value_or(NAN);
    if (!std::isfinite(value)) fail(field.line, fmt::format("expected a finite number, found {}", inQuotes(part)));
    values.push_back(value);
  }
  if (values.size() != count) {
    fail(field.line, fmt::format("expected {} numbers, found {}", count, inQuotes(field.text)));
  }
  return values;
}

glm::ivec3 HeaderFields::sizes(const HeaderField& field) const {
  const std::vector<std::string_view> parts = words(field.text);
  if (parts.size() != 3) fail(field.line, fmt::format("expected 3 sizes, found {}", inQuotes(field.text)));
  glm::ivec3 dims;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<int> size = parseNumber<int>(parts[size_t(axis)]);
    if (!size || *size < 1 || *size > kMaxDim) {
      fail(field.line, fmt::format("expected a size in 1..{}, found {}", kMaxDim, inQuotes(parts[size_t(axis)])));
    }
    dims[axis] = *size;
  }
  return dims;
}

glm::dvec3 HeaderFields::lengths(const HeaderField& field) const {
  const std::vector<double> values = numbers(field, 3);
  for (const double value : values) {
    if (!(value > 0.0)) fail(field.line, fmt::format("expected a positive spacing, found {}", value));
  }
  return {values[0], values[1], values[2]};
}

std::string besideHeader(const std::string& headerPath, std::string_view name, const std::string& where) {
  const std::filesystem::path folder = std::filesystem::path(headerPath).parent_path();
  const std::string path = (folder / std::filesystem::path(name)).lexically_normal().string();
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw InputError(fmt::format("{}: data file {} does not exist", where, path));
  }
  return path;
}

}  // namespace freevoxel
