// The rows that a sweep works on, out of one piece of memory.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace freevoxel {

/// Memory of one sweep after another. Whoever keeps it between sweeps spares the next one its pages: memory that nobody
/// has touched takes longer to come by than to sweep. In huge pages where the system has them to give, since sweeps
/// walk through many rows at once. Serves one sweep at a time.
class SweepMemory {
 public:
  SweepMemory() = default;
  ~SweepMemory();
  SweepMemory(const SweepMemory&) = delete;
  SweepMemory& operator=(const SweepMemory&) = delete;

  /// Takes back all that it gave and makes room for `capacity` numbers of 32 bits; throws MachineError.
  void begin(uint64_t capacity);

  /// The next `count` numbers, a multiple of 16, on cache lines of their own, all 0. Those that nobody has had yet are
  /// near whoever uses them first. Safe to call from many threads.
  uint32_t* zeros(size_t count);

 private:
  void unmap();

  uint32_t* first_ = nullptr;
  uint64_t capacity_ = 0;  ///< mapped
  uint64_t dirty_ = 0;     ///< numbers that earlier sweeps had
  std::atomic<uint64_t> used_{0};
};

}  // namespace freevoxel
