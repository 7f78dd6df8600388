// A file as a whole in memory.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace freevoxel {

/// All bytes of a file, inflated if it is a gzip stream. Memory grows with what is really there. Throws InputError if
/// it cannot be read, is damaged, or holds more than `atMost` bytes.
std::vector<std::byte> readWholeFile(const std::string& path, size_t atMost);

/// The bytes as text.
inline std::string_view asText(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace freevoxel
