// What a volume file shows before it is read: enough to tell its format.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace freevoxel {

struct FileStart {
  std::string path;
  std::string extension;         ///< lower case with its dot, that before ".gz" if there is one: ".raw" of a.raw.gz
  bool compressed = false;       ///< the whole file is a gzip stream
  std::vector<std::byte> bytes;  ///< up to 1024 from the beginning, inflated if compressed

  bool startsWith(std::string_view text) const;
};

/// Throws InputError if the file is missing, no regular file, or a damaged gzip stream.
FileStart readFileStart(const std::string& path);

}  // namespace freevoxel
