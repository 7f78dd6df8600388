// Files that appear whole or not at all.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace freevoxel {

/// A file written under a temporary name beside its target, then synced and renamed. Destroyed before commit(), it
/// removes the temporary file; if the program is killed, the next one that writes the same target does. It tells the
/// dead from the living by a lock (flock) that every AtomicFile holds on its temporary file. Move-only.
class AtomicFile {
 public:
  /// Also removes temporary files of the same target that nobody holds. Throws MachineError if the temporary file
  /// cannot be made (directory missing, not writable).
  explicit AtomicFile(std::string path);
  /// The file that another process makes as temporaryPath(), for writing into it: committing and removing it are left
  /// to that one. Throws MachineError.
  static AtomicFile join(std::string path, const std::string& temporaryPath);
  ~AtomicFile();
  AtomicFile(AtomicFile&& other) noexcept;
  AtomicFile& operator=(AtomicFile&&) = delete;

  const std::string& path() const { return path_; }
  /// For libraries that write by name; has the target's extension.
  const std::string& temporaryPath() const { return temporaryPath_; }
  int descriptor() const { return descriptor_; }

  /// Makes the file `bytes` long with its blocks allocated, so that a full disk shows here and not as SIGBUS in a
  /// mapping. Throws MachineError.
  void reserve(uint64_t bytes);
  /// Writes all of `bytes` at `offset`. Throws MachineError.
  void writeAt(uint64_t offset, std::span<const std::byte> bytes);
  /// Copies `bytes` bytes from offset `from` to `to` <= `from`. Throws MachineError.
  void moveDown(uint64_t from, uint64_t to, uint64_t bytes);
  /// Makes the file `bytes` long. Throws MachineError.
  void truncate(uint64_t bytes);
  /// Returns when all that was written is on the disk. Throws MachineError.
  void sync();
  /// Syncs and renames onto path(). Throws MachineError.
  void commit();

 private:
  AtomicFile() = default;

  std::string path_;
  std::string temporaryPath_;
  int descriptor_ = -1;
};

/// Removes the temporary files of every AtomicFile alive. For signal handlers that end the program: calls nothing but
/// unlink.
void removeTemporaryFiles() noexcept;

/// Whether a file's name is one that an AtomicFile gives until it is committed: a run that was killed may leave it.
bool isTemporaryName(const std::string& path);

}  // namespace freevoxel
