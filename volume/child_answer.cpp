#include "volume/child_answer.h"

#include <fcntl.h>
#include <malloc.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <new>

#include "base/address_sanitizer.h"
#include "base/error.h"

namespace freevoxel {

namespace {

struct Limits {
  uint64_t memoryBytes = 0;
  uint64_t processorSeconds = 0;
};

std::string readInput() {
  std::string all;
  char buffer[4096];
  for (ssize_t got = 0; (got = read(STDIN_FILENO, buffer, sizeof buffer)) != 0;) {
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) break;
    all.append(buffer, size_t(got));
  }
  return all;
}

void limit(const Limits& limits) {
  // Whoever asked may be gone before the answer.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Every thread's own heap would count as memory.
  mallopt(M_ARENA_MAX, 2);
  // A second more until the kernel kills instead of telling.
  const rlimit processor{limits.processorSeconds, limits.processorSeconds + 1};
  setrlimit(RLIMIT_CPU, &processor);
  const rlimit noCore{0, 0};
  setrlimit(RLIMIT_CORE, &noCore);
  const rlimit memory{limits.memoryBytes, limits.memoryBytes};
  if (!kUnderAddressSanitizer) setrlimit(RLIMIT_AS, &memory);
}

}  // namespace

std::string_view RequestReader::takeBytes(uint64_t count) {
  check(count <= bytes_.size(), "a request to the reading process is complete");
  const std::string_view part = bytes_.substr(0, count);
  bytes_.remove_prefix(count);
  return part;
}

void AnswerWriter::send(ChildMessage kind, std::span<const std::byte> bytes) {
  const MessageStart start{uint32_t(kind), 0, bytes.size()};
  write(std::as_bytes(std::span(&start, 1)));
  write(bytes);
}

void AnswerWriter::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) _exit(1);  // nobody listens any more
    bytes = bytes.subspan(size_t(written));
  }
}

void answerRequest(const std::function<void(const std::string&, RequestReader&, AnswerWriter&)>& read) {
  // Whatever a library prints is talk, not the answer.
  AnswerWriter answer(fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3));
  dup2(STDERR_FILENO, STDOUT_FILENO);
  const auto fail = [&](ChildMessage kind, const std::string& text) {
    answer.send(kind, std::as_bytes(std::span(text)));
  };
  Limits limits;
  std::string path;
  int status = 1;
  try {
    const std::string input = readInput();
    const std::string inner = RequestReader(input).takeText();
    RequestReader request(inner);
    limits.memoryBytes = request.take<uint64_t>();
    limits.processorSeconds = request.take<uint64_t>();
    path = request.takeText();
    limit(limits);
    read(path, request, answer);
    answer.send(ChildMessage::end, {});
    status = 0;
  } catch (const InputError& error) {
    fail(ChildMessage::inputError, error.what());
  } catch (const std::bad_alloc&) {
    fail(ChildMessage::inputError,
         fmt::format("{}: reading it takes more than {} MiB of memory", path, limits.memoryBytes >> 20));
  } catch (const MachineError& error) {
    fail(ChildMessage::machineError, error.what());
  } catch (const std::exception& error) {
    fail(ChildMessage::inputError, fmt::format("{}: {}", path, error.what()));
  }
  // The libraries' own ends are no concern of ours, and some of them take long or fail.
  _exit(status);
}

}  // namespace freevoxel
