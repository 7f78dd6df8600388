#include "base/mapped_file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <utility>

#include "base/error.h"

namespace freevoxel {

/// A guarded map, where the signal handler can read it. `end` is set last and cleared first.
struct MappedFile::Guard {
  std::atomic<bool> taken{false};
  std::atomic<uintptr_t> begin{0};
  std::atomic<uintptr_t> end{0};
  std::atomic<bool> lost{false};

  static std::array<Guard, 64>& all() {
    static std::array<Guard, 64> guards;
    return guards;
  }
  static void handle(int number, siginfo_t* info, void* context);
  static void install();
};

namespace {

struct sigaction handlerBefore {};

}  // namespace

/// Puts a page of zeros where a page of a guarded file is gone. Calls nothing but mmap, a bare system call.
void MappedFile::Guard::handle(int number, siginfo_t* info, void* context) {
  const int error = errno;
  const auto address = uintptr_t(info->si_addr);
  for (Guard& guard : all()) {
    if (address < guard.begin.load() || address >= guard.end.load()) continue;
    const auto pageBytes = uintptr_t(4096);
    void* page = reinterpret_cast<void*>(address / pageBytes * pageBytes);
    guard.lost.store(true);
    if (mmap(page, pageBytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0) != MAP_FAILED) {
      errno = error;
      return;
    }
  }
  if ((handlerBefore.sa_flags & SA_SIGINFO) != 0) {
    handlerBefore.sa_sigaction(number, info, context);
  } else {
    // Comes again when the instruction does, and ends the program as it should.
    signal(number, SIG_DFL);
  }
}

void MappedFile::Guard::install() {
  static std::once_flag installed;
  std::call_once(installed, [] {
    all();
    struct sigaction action {};
    action.sa_sigaction = handle;
    action.sa_flags = SA_SIGINFO;
    sigemptyset(&action.sa_mask);
    sigaction(SIGBUS, &action, &handlerBefore);
  });
}

MappedFile::MappedFile(const std::string& path) : path_(path) {
  descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0) throw InputError(fmt::format("{}: cannot open: {}", path, std::strerror(errno)));
  struct stat status {};
  if (fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
    close(descriptor_);
    throw InputError(fmt::format("{}: is not a regular file", path));
  }
  if (status.st_size == 0) return;
  void* data = mmap(nullptr, size_t(status.st_size), PROT_READ, MAP_SHARED, descriptor_, 0);
  if (data == MAP_FAILED) {
    const int error = errno;
    close(descriptor_);
    throw InputError(fmt::format("{}: cannot map: {}", path, std::strerror(error)));
  }
  data_ = static_cast<const std::byte*>(data);
  size_ = size_t(status.st_size);
}

MappedFile::~MappedFile() {
  if (guard_ != nullptr) {
    guard_->end.store(0);
    guard_->begin.store(0);
    guard_->taken.store(false);
  }
  if (data_ != nullptr) munmap(const_cast<std::byte*>(data_), size_);
  if (descriptor_ >= 0) close(descriptor_);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      data_(std::exchange(other.data_, nullptr)),
      size_(std::exchange(other.size_, 0)),
      guard_(std::exchange(other.guard_, nullptr)) {}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  std::swap(guard_, other.guard_);
  return *this;
}

void MappedFile::guard() {
  if (data_ == nullptr || guard_ != nullptr) return;
  Guard::install();
  for (Guard& guard : Guard::all()) {
    if (guard.taken.exchange(true)) continue;
    guard.lost.store(false);
    guard.begin.store(uintptr_t(data_));
    guard.end.store(uintptr_t(data_) + size_);
    guard_ = &guard;
    return;
  }
}

void MappedFile::checkIntact() const {
  if (descriptor_ < 0) return;
  struct stat status {};
  if (fstat(descriptor_, &status) != 0) {
    throw InputError(fmt::format("{}: cannot read its size again: {}", path_, std::strerror(errno)));
  }
  if (uint64_t(status.st_size) != size_) {
    throw InputError(fmt::format("{}: changed while it was read: expected {} bytes, found {}", path_, size_,
                                 uint64_t(status.st_size)));
  }
  if (guard_ != nullptr && guard_->lost.load()) {
    throw InputError(
        fmt::format("{}: could not be read everywhere: it was cut for a moment, or its disk fails", path_));
  }
}

}  // namespace freevoxel
