// The child's side of volume/child_process.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "volume/child_messages.h"

namespace freevoxel {

/// Takes what RequestWriter wrote. Throws InternalError if it is not all there.
class RequestReader {
 public:
  explicit RequestReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  T take() {
    T value{};
    std::memcpy(&value, takeBytes(sizeof value).data(), sizeof value);
    return value;
  }
  std::string takeText() { return std::string(takeBytes(take<uint64_t>())); }
  bool done() const { return bytes_.empty(); }

 private:
  std::string_view takeBytes(uint64_t count);

  std::string_view bytes_;
};

/// Sends messages to the parent.
class AnswerWriter {
 public:
  explicit AnswerWriter(int descriptor) : descriptor_(descriptor) {}
  void send(ChildMessage kind, std::span<const std::byte> bytes);

 private:
  void write(std::span<const std::byte> bytes);

  int descriptor_;
};

/// Limits the process as the request on standard input asks, calls `read` with the path that the user named, the task's
/// own request and the way to answer, and ends the process; what `read` throws, the parent throws. Anything written to
/// standard output by others is talk.
[[noreturn]] void answerRequest(
    const std::function<void(const std::string& path, RequestReader& request, AnswerWriter& answer)>& read);

}  // namespace freevoxel
