// A file mapped for reading.
#pragma once

#include <cstddef>
#include <memory>
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

  /// From here on bytes that the file no longer has (somebody cut it, or the disk fails) read as zeros instead of
  /// ending the program by SIGBUS, and checkIntact() tells of it. At most 64 files at a time; more are not guarded.
  void guard();
  /// Throws InputError if the file has not the size it was opened with or, guarded, if any byte read since was lost.
  /// What was read before is only good if this returns. From many threads.
  void checkIntact() const;

 private:
  struct Guard;

  std::string path_;
  int descriptor_ = -1;
  const std::byte* data_ = nullptr;
  size_t size_ = 0;
  Guard* guard_ = nullptr;  ///< in the table that the signal handler reads
};

}  // namespace freevoxel
