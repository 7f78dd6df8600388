// A file mapped for reading.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace freevoxel {

/// Read-only map of a whole file. Move-only; empty by default.
class MappedFile {
 public:
  MappedFile() = default;
  /// Throws InputError if the file is missing, is no regular file, or cannot be read.
  explicit MappedFile(const std::string& path);
  ~MappedFile();
  MappedFile(MappedFile&& other) noexcept;
  MappedFile& operator=(MappedFile&& other) noexcept;

  std::span<const std::byte> bytes() const { return {data_, size_}; }

 private:
  const std::byte* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace freevoxel
