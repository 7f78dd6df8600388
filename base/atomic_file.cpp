#include "base/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "base/error.h"

namespace freevoxel {

namespace {

MachineError failure(const std::string& path, const char* doing, int error) {
  const char* advice = error == ENOSPC ? "; free some space or choose another output folder" : "";
  return MachineError(fmt::format("{}: {}: {}{}", path, doing, std::strerror(error), advice));
}

/// Paths of the temporary files that exist, where a signal handler can read them. More than fit are not cleaned up.
std::array<std::atomic<const char*>, 32> temporaries{};

void remember(const std::string& path) {
  const char* copy = strdup(path.c_str());
  for (std::atomic<const char*>& slot : temporaries) {
    const char* empty = nullptr;
    if (slot.compare_exchange_strong(empty, copy)) return;
  }
  free(const_cast<char*>(copy));
}

void forget(const std::string& path) {
  for (std::atomic<const char*>& slot : temporaries) {
    const char* held = slot.load();
    if (held != nullptr && path == held && slot.compare_exchange_strong(held, nullptr)) {
      free(const_cast<char*>(held));
      return;
    }
  }
}

}  // namespace

void removeTemporaryFiles() noexcept {
  for (const std::atomic<const char*>& slot : temporaries) {
    if (const char* path = slot.load(); path != nullptr) unlink(path);
  }
}

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  const std::filesystem::path target(path_);
  if (std::filesystem::is_directory(target)) throw MachineError(fmt::format("{}: is a folder, not a file", path_));
  const std::string extension = target.extension().string();
  const std::string stem = (target.parent_path() / fmt::format(".{}", target.stem().string())).string();
  temporaryPath_ = stem + ".partial-XXXXXX" + extension;
  descriptor_ = mkostemps(temporaryPath_.data(), int(extension.size()), O_CLOEXEC);
  if (descriptor_ < 0) throw failure(path_, "cannot create the output file", errno);
  remember(temporaryPath_);
  // mkostemps makes files private; the result should have the rights that any new file has.
  const mode_t mask = umask(0);
  umask(mask);
  fchmod(descriptor_, 0666 & ~mask);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)),
      temporaryPath_(std::exchange(other.temporaryPath_, {})),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) close(descriptor_);
  if (temporaryPath_.empty()) return;
  unlink(temporaryPath_.c_str());
  forget(temporaryPath_);
}

void AtomicFile::reserve(uint64_t bytes) {
  if (const int error = posix_fallocate(descriptor_, 0, off_t(bytes)); error != 0) {
    throw failure(path_, "cannot reserve space for the output file", error);
  }
}

void AtomicFile::writeAt(uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = pwrite(descriptor_, bytes.data(), bytes.size(), off_t(offset));
    if (written < 0) {
      if (errno == EINTR) continue;
      throw failure(path_, "cannot write", errno);
    }
    bytes = bytes.subspan(size_t(written));
    offset += uint64_t(written);
  }
}

void AtomicFile::moveDown(uint64_t from, uint64_t to, uint64_t bytes) {
  check(to <= from, "bytes are moved down");
  if (to == from) return;
  constexpr uint64_t kPiece = uint64_t(1) << 20;
  std::vector<std::byte> buffer(std::min(bytes, kPiece));
  while (bytes > 0) {
    const ssize_t count = pread(descriptor_, buffer.data(), std::min(bytes, kPiece), off_t(from));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw failure(path_, "cannot read back", errno);
    check(count > 0, "bytes to be moved have been written");
    writeAt(to, std::span(buffer).first(size_t(count)));
    from += uint64_t(count);
    to += uint64_t(count);
    bytes -= uint64_t(count);
  }
}

void AtomicFile::truncate(uint64_t bytes) {
  if (ftruncate(descriptor_, off_t(bytes)) != 0) throw failure(path_, "cannot shorten", errno);
}

void AtomicFile::commit() {
  // A library may have written by name and replaced the file: sync what stands there now.
  const int written = open(temporaryPath_.c_str(), O_RDONLY | O_CLOEXEC);
  if (written < 0) throw failure(path_, "cannot finish", errno);
  const int error = fsync(written) == 0 ? 0 : errno;
  close(written);
  if (error != 0) throw failure(path_, "cannot sync", error);
  if (rename(temporaryPath_.c_str(), path_.c_str()) != 0) throw failure(path_, "cannot rename into place", errno);
  forget(temporaryPath_);
  temporaryPath_.clear();
}

}  // namespace freevoxel
