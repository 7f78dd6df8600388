// What readers of small headers share: fields by name and line, binary fields by offset.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "volume/stored_values.h"

namespace freevoxel {

/// Lines "name SEPARATOR value" of a text header. Views refer to the text.
struct HeaderField {
  int line = 0;
  std::string_view text;  ///< trimmed
};

struct HeaderFields {
  std::string path;
  std::map<std::string, HeaderField> fields;  ///< by lower-case name

  /// Throws InputError with file and line.
  [[noreturn]] void fail(int line, const std::string& what) const;
  const HeaderField* find(const std::string& name) const;
  /// The first of several names for one thing that is there, or null.
  const HeaderField* findAny(std::initializer_list<const char*> names) const;
  /// Throws InputError if it is not there.
  const HeaderField& need(const std::string& name) const;

  /// Exactly `count` finite numbers.
  std::vector<double> numbers(const HeaderField& field, size_t count) const;
  /// Three sizes, each in 1..kMaxDim.
  glm::ivec3 sizes(const HeaderField& field) const;
  /// Three lengths above 0.
  glm::dvec3 lengths(const HeaderField& field) const;
};

/// Number at a byte of a binary header, which must lie inside.
template <class T>
T numberAt(std::span<const std::byte> header, size_t offset, ByteOrder order) {
  std::byte raw[sizeof(T)];
  const bool native = (order == ByteOrder::little) == (std::endian::native == std::endian::little);
  for (size_t i = 0; i < sizeof(T); ++i)
    raw[i] = header[offset + (native ? i : sizeof(T) - 1 - i)];
  return std::bit_cast<T>(raw);
}

/// A file named in another, relative to that other's folder. Throws InputError "`where`: ..." if it does not exist.
std::string besideHeader(const std::string& headerPath, std::string_view name, const std::string& where);

}  // namespace freevoxel
