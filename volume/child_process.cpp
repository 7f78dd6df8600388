#include "volume/child_process.h"

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

#include "base/error.h"
#include "base/grid.h"

extern char** environ;

namespace freevoxel {

namespace {

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

uint64_t memoryLimit(const ChildTask& task, const ChildLimits& limits) {
  uint64_t fileBytes = 0;
  for (const std::string& file : task.files) {
    std::error_code error;
    const uint64_t bytes = std::filesystem::file_size(file, error);
    if (!error) fileBytes += bytes;
  }
  const uint64_t machine = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
  const std::optional<uint64_t> wanted =
      checkedSum(limits.memoryBytes, checkedProduct(fileBytes, limits.memoryPerFileByte).value_or(machine));
  return std::min(wanted.value_or(machine), machine);
}

std::string requestBytes(const ChildTask& task, const ChildLimits& limits) {
  RequestWriter inner;
  inner.add(memoryLimit(task, limits));
  inner.add(uint64_t(limits.processorSeconds));
  inner.addText(task.path);
  RequestWriter all;
  all.addText(inner.take() + task.request);
  return all.take();
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

}  // namespace

ChildProgram& childProgram() {
  static ChildProgram program;
  return program;
}

Descriptor::~Descriptor() {
  if (value_ >= 0) close(value_);
}

ChildProcess::ChildProcess(const ChildTask& task, const ChildProgram& program)
    : path_(task.path), format_(task.formatName), limits_(program.limits) {
  limits_.memoryBytes = memoryLimit(task, program.limits);
  const Descriptor input = requestFile(requestBytes(task, program.limits));
  Pipe answer = makePipe(), talk = makePipe();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, answer.writing.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, talk.writing.get(), STDERR_FILENO);
  std::string name = "freevoxel", argument = task.argument;
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

ChildProcess::~ChildProcess() {
  if (process_ < 0) return;
  kill(process_, SIGKILL);
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
}

void ChildProcess::receive(std::span<std::byte> out) {
  while (!out.empty()) {
    waitForAnswer();
    const ssize_t got = ::read(answer_.get(), out.data(), out.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) failEnded();
    out = out.subspan(size_t(got));
  }
}

MessageStart ChildProcess::receiveStart() {
  MessageStart start;
  receive(std::as_writable_bytes(std::span(&start, 1)));
  const auto kind = ChildMessage(start.kind);
  if (kind != ChildMessage::inputError && kind != ChildMessage::machineError) return start;
  std::string text(std::min<uint64_t>(start.size, 4096), '\0');
  receive(std::as_writable_bytes(std::span(text)));
  if (kind == ChildMessage::machineError) throw MachineError(oneLine(text));
  throw InputError(oneLine(text));
}

void ChildProcess::failNonsense() const {
  throw InputError(fmt::format("{}: the process that reads {} files sends nonsense", path_, format_));
}

/// Returns when there is something to read or the child has closed the pipe.
void ChildProcess::waitForAnswer() {
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
bool ChildProcess::listen() {
  std::array<char, 4096> buffer;
  const ssize_t got = ::read(talk_.get(), buffer.data(), buffer.size());
  if (got < 0 && errno == EINTR) return true;
  if (got <= 0) return false;
  constexpr size_t kLongest = 300;
  heard_.append(buffer.data(), std::min(size_t(got), kLongest - std::min(kLongest, heard_.size())));
  return true;
}

std::string ChildProcess::said() const {
  const std::string line = oneLine(std::string_view(heard_).substr(0, heard_.find('\n')));
  return line.empty() ? std::string() : fmt::format(" (it said: {})", line);
}

void ChildProcess::failEnded() {
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

}  // namespace freevoxel
