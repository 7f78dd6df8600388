// The rows that a sweep works on, out of one piece of memory.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace freevoxel {

/// Zeros that nobody has touched: whoever uses them first has them near. In huge pages where the system has them to
/// give, since sweeps walk through many rows at once.
class SweepMemory {
 public:
  /// Room for so many numbers of 32 bits; throws MachineError.
  explicit SweepMemory(uint64_t capacity);
  ~SweepMemory();
  SweepMemory(const SweepMemory&) = delete;
  SweepMemory& operator=(const SweepMemory&) = delete;

  /// The next `count`, a multiple of 16, on cache lines of their own. Safe to call from many threads.
  uint32_t* zeros(size_t count);

 private:
  uint32_t* first_ = nullptr;
  uint64_t capacity_;
  std::atomic<uint64_t> used_{0};
};

}  // namespace freevoxel
