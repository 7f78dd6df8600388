// What the parts of the reader share: errors that name file, offset, expected and found, and copies out of the map.
#pragma once

#include <fmt/core.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/error.h"
#include "precompute/format.h"

namespace freevoxel {

inline std::string_view text(const SectionType& type) {
  return {type.data(), type.size()};
}

/// Printable whatever bytes a damaged file holds.
inline std::string quoted(const SectionType& type) {
  std::string result;
  for (const char c : type) {
    result += c > ' ' && c < 127 ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return result;
}

template <class Expected, class Found>
InputError mismatch(const std::string& path, uint64_t offset, std::string_view what, const Expected& expected,
                    const Found& found) {
  return InputError(fmt::format("{}: at byte {}: {}: expected {}, found {}", path, offset, what, expected, found));
}

/// A copy of T from a map; `offset + sizeof(T)` lies inside.
template <class T>
T copyAt(std::span<const std::byte> bytes, uint64_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

template <class T>
std::vector<T> copyOf(std::span<const std::byte> bytes) {
  std::vector<T> items(bytes.size() / sizeof(T));
  if (!items.empty()) std::memcpy(items.data(), bytes.data(), items.size() * sizeof(T));
  return items;
}

/// Throws InputError naming the frame unless frames fill their section without gap or overlap. `frame(i)`: offset and
/// bytes of entry i of `count`. The directory lies at `directory`, `entryBytes` an entry, with the two fields at these
/// places in it.
void checkFrameList(const std::string& path, const SectionEntry& section, size_t count, uint64_t directory,
                    size_t entryBytes, const std::function<std::pair<uint64_t, uint32_t>(size_t)>& frame,
                    size_t offsetField, size_t bytesField);

}  // namespace freevoxel
