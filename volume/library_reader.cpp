// The child's side of volume/child_reader.h.
#include <fcntl.h>
#include <malloc.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>

#include "base/address_sanitizer.h"
#include "base/error.h"
#include "volume/child_messages.h"
#include "volume/slice_sink.h"

namespace freevoxel {

namespace {

struct Request {
  LibraryRequest library;
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

/// Takes what volume/child_messages.h describes from a text.
class RequestReader {
 public:
  explicit RequestReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    T value{};
    const std::string_view part = takeBytes(sizeof value);
    std::memcpy(&value, part.data(), sizeof value);
    return value;
  }
  std::string takeText() { return std::string(takeBytes(take<uint64_t>())); }
  bool done() const { return bytes_.empty(); }

 private:
  std::string_view takeBytes(uint64_t count) {
    check(count <= bytes_.size(), "a request to the reading process is complete");
    const std::string_view part = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return part;
  }

  std::string_view bytes_;
};

Request parseRequest(const std::string& bytes) {
  RequestReader outer(bytes);
  const std::string inner = outer.takeText();
  RequestReader reader(inner);
  Request request;
  request.library.format = LibraryFormat(reader.take<uint32_t>());
  const bool hasComponent = reader.take<uint32_t>() != 0;
  const bool hasSpacing = reader.take<uint32_t>() != 0;
  request.library.labels = reader.take<uint32_t>() != 0;
  glm::dvec3 spacing;
  for (int axis = 0; axis < 3; ++axis)
    spacing[axis] = reader.take<double>();
  if (hasSpacing) request.library.spacing = spacing;
  request.memoryBytes = reader.take<uint64_t>();
  request.processorSeconds = reader.take<uint64_t>();
  const std::string component = reader.takeText();
  if (hasComponent) request.library.component = component;
  request.library.path = reader.takeText();
  while (!reader.done())
    request.library.files.push_back(reader.takeText());
  return request;
}

void limit(const Request& request) {
  // Whoever asked may be gone before the answer.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Every thread's own heap would count as memory.
  mallopt(M_ARENA_MAX, 2);
  // A second more until the kernel kills instead of telling.
  const rlimit processor{request.processorSeconds, request.processorSeconds + 1};
  setrlimit(RLIMIT_CPU, &processor);
  const rlimit noCore{0, 0};
  setrlimit(RLIMIT_CORE, &noCore);
  const rlimit memory{request.memoryBytes, request.memoryBytes};
  if (!kUnderAddressSanitizer) setrlimit(RLIMIT_AS, &memory);
}

class Answer final : public SliceSink {
 public:
  explicit Answer(int descriptor, const LibraryRequest& request) : descriptor_(descriptor), request_(request) {}

  void header(const VolumeHeader& header) override {
    Placement placement = header.placement;
    if (request_.spacing) placement.spacing = *request_.spacing;
    HeaderMessage message;
    message.type = uint32_t(header.type);
    for (int axis = 0; axis < 3; ++axis) {
      message.dims[size_t(axis)] = header.dims[axis];
      message.spacing[size_t(axis)] = placement.spacing[axis];
      message.origin[size_t(axis)] = placement.origin[axis];
      for (int row = 0; row < 3; ++row)
        message.direction[size_t(3 * axis + row)] = placement.direction[axis][row];
    }
    send(ChildMessage::header, std::as_bytes(std::span(&message, 1)));
  }
  void values(std::span<const std::byte> bytes) override {
    if (!bytes.empty()) send(ChildMessage::values, bytes);
  }
  void error(ChildMessage kind, const std::string& text) { send(kind, std::as_bytes(std::span(text))); }
  void end() { send(ChildMessage::end, {}); }

 private:
  void send(ChildMessage kind, std::span<const std::byte> bytes) {
    const MessageStart start{uint32_t(kind), 0, bytes.size()};
    write(std::as_bytes(std::span(&start, 1)));
    write(bytes);
  }
  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) _exit(1);  // nobody listens any more
      bytes = bytes.subspan(size_t(written));
    }
  }

  int descriptor_;
  const LibraryRequest& request_;
};

}  // namespace

void readWithLibrary(const LibraryRequest& request, SliceSink& sink) {
  switch (request.format) {
    case LibraryFormat::imageStack:
      return readImageStack(request, sink);
    case LibraryFormat::dicom:
      return readDicom(request, sink);
    case LibraryFormat::vdb:
      return readVdb(request, sink);
  }
  throw InternalError("internal error: no such format of a library");
}

int runLibraryReader() {
  // Whatever a library prints is talk, not the answer.
  const int answerDescriptor = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  dup2(STDERR_FILENO, STDOUT_FILENO);
  Request request;
  Answer answer(answerDescriptor, request.library);
  int status = 1;
  try {
    request = parseRequest(readInput());
    limit(request);
    readWithLibrary(request.library, answer);
    answer.end();
    status = 0;
  } catch (const InputError& error) {
    answer.error(ChildMessage::inputError, error.what());
  } catch (const std::bad_alloc&) {
    answer.error(ChildMessage::inputError, fmt::format("{}: reading it takes more than {} MiB of memory",
                                                       request.library.path, request.memoryBytes >> 20));
  } catch (const MachineError& error) {
    answer.error(ChildMessage::machineError, error.what());
  } catch (const std::exception& error) {
    answer.error(ChildMessage::inputError, fmt::format("{}: {}", request.library.path, error.what()));
  }
  // The libraries' own ends are no concern of ours, and some of them take long or fail.
  _exit(status);
}

}  // namespace freevoxel
