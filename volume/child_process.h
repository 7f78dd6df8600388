// A process that reads foreign files: what a library does with a damaged file (die, hang, eat memory) happens there,
// and here it is one line (DESIGN section 11).
//
// The child is this same program started again with one hidden argument (app/main.cpp), never a mere fork, so it does
// not matter what threads and what OpenGL the parent has by then. The request goes to its standard input, what it reads
// comes back through a pipe (volume/child_messages.h).
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "volume/child_messages.h"

namespace freevoxel {

/// What a child may use. Memory is address space: this much and 16 times the size of the files, but no more than the
/// machine has.
struct ChildLimits {
  uint64_t memoryBytes = uint64_t(4) << 30;
  uint64_t memoryPerFileByte = 16;
  int processorSeconds = 600;
  int silentSeconds = 60;  ///< waiting for it without anything coming
};

/// The program that reads, and its limits; one for the process, for tests to change before they read.
struct ChildProgram {
  std::string path = "/proc/self/exe";
  ChildLimits limits;
};
ChildProgram& childProgram();

/// What a child is started for.
struct ChildTask {
  std::string argument;            ///< that makes the program this kind of reader, the only one it is given
  std::string formatName;          ///< for messages: "OpenVDB"
  std::string path;                ///< as the user named it
  std::vector<std::string> files;  ///< whose sizes set the limit of memory
  std::string request;             ///< what the reader takes, by RequestWriter
};

/// The bytes of a request: numbers and texts in order.
class RequestWriter {
 public:
  template <class T>
  void add(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void addText(const std::string& text) {
    add(uint64_t(text.size()));
    bytes_ += text;
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// A descriptor, closed at the end; -1 is none. Move-only.
class Descriptor {
 public:
  explicit Descriptor(int value = -1) : value_(value) {}
  Descriptor(Descriptor&& other) noexcept : value_(std::exchange(other.value_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(value_, other.value_);
    return *this;
  }
  ~Descriptor();
  int get() const { return value_; }

 private:
  int value_;
};

/// A running child: its process, what it sends, what it says on the way. Killed at the end if it still runs.
class ChildProcess {
 public:
  /// Throws MachineError if it cannot be started.
  ChildProcess(const ChildTask& task, const ChildProgram& program);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  /// Fills `out` with what the child sends next. Throws InputError if it ends or falls silent before that.
  void receive(std::span<std::byte> out);
  /// The start of the next message; an error that the child reports is thrown.
  MessageStart receiveStart();
  /// Throws InputError: the child sends what makes no sense.
  [[noreturn]] void failNonsense() const;

 private:
  void waitForAnswer();
  bool listen();
  std::string said() const;
  [[noreturn]] void failEnded();

  std::string path_, format_;
  ChildLimits limits_;
  pid_t process_ = -1;
  Descriptor answer_, talk_;
  std::string heard_;
};

}  // namespace freevoxel
