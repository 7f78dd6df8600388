#include "base/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>
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

constexpr std::string_view kMark = ".partial-";
constexpr size_t kRandomCharacters = 6;  // of mkostemps

/// Whether `name` is one that an AtomicFile for stem + extension makes up, or an AtomicFile for such a name, and so on.
bool isTemporaryOf(std::string_view name, std::string_view stem, std::string_view extension) {
  if (!name.starts_with('.') || !name.ends_with(extension)) return false;
  name.remove_suffix(extension.size());
  name.remove_prefix(std::min(name.find_first_not_of('.'), name.size()));
  // A stem may itself start with dots.
  stem.remove_prefix(std::min(stem.find_first_not_of('.'), stem.size()));
  if (!name.starts_with(stem)) return false;
  name.remove_prefix(stem.size());
  if (name.empty()) return false;
  while (name.starts_with(kMark) && name.size() >= kMark.size() + kRandomCharacters) {
    const auto random = name.substr(kMark.size(), kRandomCharacters);
    if (!std::all_of(random.begin(), random.end(), [](unsigned char c) { return std::isalnum(c) != 0; })) return false;
    name.remove_prefix(kMark.size() + kRandomCharacters);
  }
  return name.empty();
}

/// Removes the temporary files of runs that ended without doing so: those that nobody holds a lock on.
void removeDeadTemporaries(const std::filesystem::path& target) {
  const std::string stem = target.stem().string(), extension = target.extension().string();
  const std::filesystem::path folder = target.has_parent_path() ? target.parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  for (std::filesystem::directory_iterator entry(folder, ignored), end; !ignored && entry != end;
       entry.increment(ignored)) {
    if (!isTemporaryOf(entry->path().filename().string(), stem, extension)) continue;
    const int descriptor = open(entry->path().c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) continue;
    struct stat status {};
    if (fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) && flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
      unlink(entry->path().c_str());
    }
    close(descriptor);
  }
}

/// Makes and opens a file of a name that nobody has; `name` ends in XXXXXX and `extension`. The file is locked, unless
/// its disk knows no locks. -1 if that fails.
int makeTemporary(std::string& name, size_t extensionBytes) {
  const std::string pattern = name;
  while (true) {
    const int descriptor = mkostemps(name.data(), int(extensionBytes), O_CLOEXEC);
    if (descriptor < 0) return -1;
    while (flock(descriptor, LOCK_EX) != 0 && errno == EINTR) {
    }
    // Another run may have come between and taken it for a dead one's.
    struct stat status {};
    if (fstat(descriptor, &status) == 0 && status.st_nlink > 0) return descriptor;
    close(descriptor);
    name = pattern;
  }
}

}  // namespace

bool isTemporaryName(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename().string();
  const size_t mark = name.rfind(kMark);
  if (!name.starts_with('.') || mark == std::string::npos) return false;
  const std::string_view rest = std::string_view(name).substr(mark + kMark.size());
  return rest.size() == kRandomCharacters || (rest.size() > kRandomCharacters && rest[kRandomCharacters] == '.');
}

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
  removeDeadTemporaries(target);
  temporaryPath_ = fmt::format("{}{}{}{}", stem, kMark, std::string(kRandomCharacters, 'X'), extension);
  descriptor_ = makeTemporary(temporaryPath_, extension.size());
  if (descriptor_ < 0) throw failure(path_, "cannot create the output file", errno);
  remember(temporaryPath_);
  // mkostemps makes files private; the result should have the rights that any new file has.
  const mode_t mask = umask(0);
  umask(mask);
  fchmod(descriptor_, 0666 & ~mask);
}

AtomicFile AtomicFile::join(std::string path, const std::string& temporaryPath) {
  AtomicFile file;
  file.path_ = std::move(path);
  file.descriptor_ = open(temporaryPath.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (file.descriptor_ < 0) {
    throw MachineError(
        fmt::format("{}: cannot open what another process is writing there: {}; all of them need a folder "
                    "that they share",
                    file.path_, std::strerror(errno)));
  }
  return file;
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

void AtomicFile::sync() {
  if (fsync(descriptor_) != 0) throw failure(path_, "cannot sync", errno);
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
