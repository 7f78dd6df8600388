#include "volume/child_reader.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/error.h"
#include "volume/child_messages.h"
#include "volume/payload.h"

extern char** environ;

namespace freevoxel {

namespace {

class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  ~Descriptor() {
    if (value_ >= 0) close(value_);
  }
  int get() const { return value_; }

 private:
  int value_;
};

[[noreturn]] void failToStart(const std::string& what) {
  throw MachineError(
      fmt::format("cannot start the process that reads foreign formats: {}; close other programs", what));
}

struct Pipe {
  Descriptor reading, writing;
};

Pipe makePipe() {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) failToStart(std::strerror(errno));
  return {Descriptor(ends[0]), Descriptor(ends[1])};
}

void add(std::string& bytes, const void* data, size_t size) {
  bytes.append(static_cast<const char*>(data), size);
}
template <class T>
void add(std::string& bytes, T value) {
  add(bytes, &value, sizeof value);
}
void add(std::string& bytes, const std::string& text) {
  add(bytes, uint64_t(text.size()));
  bytes += text;
}

uint64_t memoryLimit(const LibraryRequest& request, const ChildLimits& limits) {
  uint64_t fileBytes = 0;
  for (const std::string& file : request.files) {
    std::error_code error;
    const uint64_t bytes = std::filesystem::file_size(file, error);
    if (!error) fileBytes += bytes;
  }
  const uint64_t machine = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
  const std::optional<uint64_t> wanted =
      checkedSum(limits.memoryBytes, checkedProduct(fileBytes, limits.memoryPerFileByte).value_or(machine));
  return std::min(wanted.value_or(machine), machine);
}

std::string requestBytes(const LibraryRequest& request, const ChildLimits& limits) {
  std::string bytes;
  add(bytes, uint32_t(request.format));
  add(bytes, uint32_t(request.component.has_value()));
  add(bytes, uint32_t(request.spacing.has_value()));
  add(bytes, uint32_t(request.labels));
  const glm::dvec3 spacing = request.spacing.value_or(glm::dvec3(1.0));
  for (int axis = 0; axis < 3; ++axis)
    add(bytes, spacing[axis]);
  add(bytes, memoryLimit(request, limits));
  add(bytes, uint64_t(limits.processorSeconds));
  add(bytes, request.component.value_or(std::string()));
  add(bytes, request.path);
  for (const std::string& file : request.files)
    add(bytes, file);
  std::string all;
  add(all, bytes);
  return all;
}

/// A file in memory that holds the request, open at its start.
Descriptor requestFile(const std::string& bytes) {
  Descriptor file(memfd_create("freevoxel request", MFD_CLOEXEC));
  if (file.get() < 0) failToStart(std::strerror(errno));
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t written = pwrite(file.get(), bytes.data() + done, bytes.size() - done, off_t(done));
    if (written < 0) failToStart(std::strerror(errno));
    done += size_t(written);
  }
  return file;
}

/// Text of a child or a library, fit for a line of ours.
std::string oneLine(std::string_view text) {
  constexpr size_t kLongest = 600;
  std::string line;
  for (const char c : text.substr(0, kLongest))
    line += uint8_t(c) < ' ' || c == '\x7f' ? ' ' : c;
  line.erase(std::find_if(line.rbegin(), line.rend(), [](char c) { return c != ' '; }).base(), line.end());
  return line;
}

/// A running child: its process, what it sends, what it says on the way.
class Child {
 public:
  Child(const LibraryRequest& request, const ChildProgram& program)
      : path_(request.path), format_(request.formatName), limits_(program.limits) {
    limits_.memoryBytes = memoryLimit(request, program.limits);
    const Descriptor input = requestFile(requestBytes(request, program.limits));
    Pipe answer = makePipe(), talk = makePipe();
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input.get(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, answer.writing.get(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, talk.writing.get(), STDERR_FILENO);
    std::string name = "freevoxel", argument = kReaderArgument;
    std::array<char*, 3> arguments{name.data(), argument.data(), nullptr};
    const int error = posix_spawn(&process_, program.path.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) {
      process_ = -1;
      failToStart(fmt::format("{}: {}", program.path, std::strerror(error)));
    }
    answer_ = std::move(answer.reading);
    talk_ = std::move(talk.reading);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (process_ < 0) return;
    kill(process_, SIGKILL);
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
  }

  /// Fills `out` with what the child sends next. Throws InputError if it ends or falls silent before that.
  void receive(std::span<std::byte> out) {
    while (!out.empty()) {
      waitForAnswer();
      const ssize_t got = ::read(answer_.get(), out.data(), out.size());
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) failEnded();
      out = out.subspan(size_t(got));
    }
  }

  /// The start of the next message; an error that the child reports is thrown.
  MessageStart receiveStart() {
    MessageStart start;
    receive(std::as_writable_bytes(std::span(&start, 1)));
    const auto kind = ChildMessage(start.kind);
    if (kind != ChildMessage::inputError && kind != ChildMessage::machineError) return start;
    std::string text(std::min<uint64_t>(start.size, 4096), '\0');
    receive(std::as_writable_bytes(std::span(text)));
    if (kind == ChildMessage::machineError) throw MachineError(oneLine(text));
    throw InputError(oneLine(text));
  }

  [[noreturn]] void failNonsense() const {
    throw InputError(fmt::format("{}: the process that reads {} files sends nonsense", path_, format_));
  }

 private:
  /// Returns when there is something to read or the child has closed the pipe.
  void waitForAnswer() {
    std::array<pollfd, 2> readers{{{answer_.get(), POLLIN, 0}, {talk_.get(), POLLIN, 0}}};
    for (;;) {
      const int ready = poll(readers.data(), readers.size(), limits_.silentSeconds * 1000);
      if (ready < 0 && errno == EINTR) continue;
      if (ready <= 0) {
        throw InputError(fmt::format("{}: the library that reads {} files hangs: nothing came for {} seconds{}", path_,
                                     format_, limits_.silentSeconds, said()));
      }
      if (readers[1].revents != 0 && !listen()) readers[1].fd = -1;
      if (readers[0].revents != 0) return;
    }
  }

  /// Takes what the child says, and keeps its beginning; false when it says no more.
  bool listen() {
    std::array<char, 4096> buffer;
    const ssize_t got = ::read(talk_.get(), buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) return true;
    if (got <= 0) return false;
    constexpr size_t kLongest = 300;
    heard_.append(buffer.data(), std::min(size_t(got), kLongest - std::min(kLongest, heard_.size())));
    return true;
  }

  std::string said() const {
    const std::string line = oneLine(std::string_view(heard_).substr(0, heard_.find('\n')));
    return line.empty() ? std::string() : fmt::format(" (it said: {})", line);
  }

  [[noreturn]] void failEnded() {
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    // Nobody writes any more: what is left to hear ends.
    while (listen()) {
    }
    const std::string who = fmt::format("{}: the library that reads {} files", path_, format_);
    if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
      throw InputError(
          fmt::format("{} was stopped after {} seconds of processor time{}", who, limits_.processorSeconds, said()));
    }
    const std::string how = WIFSIGNALED(status)
                                ? fmt::format("died of signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)))
                                : fmt::format("ended with status {}", WEXITSTATUS(status));
    throw InputError(fmt::format("{} {}: the file is damaged, or needs more than {} MiB of memory{}", who, how,
                                 limits_.memoryBytes >> 20, said()));
  }

  std::string path_, format_;
  ChildLimits limits_;
  pid_t process_ = -1;
  Descriptor answer_, talk_;
  std::string heard_;
};

class LibrarySource final : public VolumeSource {
 public:
  LibrarySource(const LibraryRequest& request, const ChildProgram& program) : child_(request, program) {
    const MessageStart start = child_.receiveStart();
    HeaderMessage message;
    if (ChildMessage(start.kind) != ChildMessage::header || start.size != sizeof message) child_.failNonsense();
    child_.receive(std::as_writable_bytes(std::span(&message, 1)));
    if (message.type > uint32_t(ValueType::f64)) child_.failNonsense();
    header_.type = ValueType(message.type);
    header_.labels = request.labels;
    for (int axis = 0; axis < 3; ++axis) {
      header_.dims[axis] = message.dims[size_t(axis)];
      header_.placement.spacing[axis] = message.spacing[size_t(axis)];
      header_.placement.origin[axis] = message.origin[size_t(axis)];
      for (int row = 0; row < 3; ++row)
        header_.placement.direction[axis][row] = message.direction[size_t(3 * axis + row)];
    }
    checkVolumeHeader(request.path, header_);
    left_ = header_.bytes();
  }

  const VolumeHeader& header() const override { return header_; }

  void readSlices(int count, std::span<std::byte> out) override {
    checkEqual(uint64_t(out.size()), uint64_t(count) * (header_.bytes() / uint64_t(header_.dims.z)),
               "size of the room for slices");
    check(out.size() <= left_, "no more slices are asked for than the volume has");
    while (!out.empty()) {
      if (leftInMessage_ == 0) startMessage(ChildMessage::values);
      const std::span<std::byte> part = out.first(std::min<uint64_t>(out.size(), leftInMessage_));
      child_.receive(part);
      out = out.subspan(part.size());
      leftInMessage_ -= part.size();
      left_ -= part.size();
      if (left_ == 0) startMessage(ChildMessage::end);
    }
  }

 private:
  void startMessage(ChildMessage expected) {
    const MessageStart start = child_.receiveStart();
    const bool fits = expected == ChildMessage::end ? start.size == 0 : start.size > 0 && start.size <= left_;
    if (ChildMessage(start.kind) != expected || leftInMessage_ != 0 || !fits) child_.failNonsense();
    leftInMessage_ = start.size;
  }

  Child child_;
  VolumeHeader header_;
  uint64_t left_ = 0;
  uint64_t leftInMessage_ = 0;
};

}  // namespace

ChildProgram& childProgram() {
  static ChildProgram program;
  return program;
}

std::unique_ptr<VolumeSource> openWithLibrary(const LibraryRequest& request) {
  return std::make_unique<LibrarySource>(request, childProgram());
}

}  // namespace freevoxel
