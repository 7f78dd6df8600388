// A tiny file of every format and encoding, for tests that damage it.
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace freevoxel::test {

struct TinyFile {
  std::string format;  ///< for test names
  std::string fileName;
  std::string bytes;
};
/// For GoogleTest's messages.
inline void PrintTo(const TinyFile& file, std::ostream* out) {
  *out << file.format;
}

/// Those that our own parsers read.
std::vector<TinyFile> tinyFiles();

}  // namespace freevoxel::test
