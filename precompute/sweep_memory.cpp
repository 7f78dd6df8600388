#include "precompute/sweep_memory.h"

#include <fmt/core.h>
#include <sys/mman.h>

#include <algorithm>

#include "base/error.h"

namespace freevoxel {

namespace {

constexpr uint64_t kHugePage = uint64_t(2) << 20;

}  // namespace

SweepMemory::~SweepMemory() {
  unmap();
}

void SweepMemory::unmap() {
  if (first_ != nullptr) munmap(first_, capacity_ * sizeof(uint32_t));
  first_ = nullptr;
  capacity_ = dirty_ = 0;
}

void SweepMemory::begin(uint64_t capacity) {
  dirty_ = std::max(dirty_, used_.exchange(0));
  if (capacity <= capacity_) return;
  unmap();
  const uint64_t bytes = capacity * sizeof(uint32_t);
  const uint64_t slack = bytes >= kHugePage ? kHugePage : 0;
  void* const mapped = mmap(nullptr, bytes + slack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (mapped == MAP_FAILED) throw MachineError(fmt::format("no memory for {} bytes of sweeps", bytes));
  auto* begin = static_cast<uint8_t*>(mapped);
  if (slack != 0) {
    const uint64_t before = (kHugePage - reinterpret_cast<uintptr_t>(begin) % kHugePage) % kHugePage;
    if (before != 0) munmap(begin, before);
    begin += before;
    const uint64_t pages = (bytes + 4095) / 4096 * 4096;
    if (pages < bytes + slack - before) munmap(begin + pages, bytes + slack - before - pages);
    madvise(begin, bytes, MADV_HUGEPAGE);  // only advice
  }
  first_ = reinterpret_cast<uint32_t*>(begin);
  capacity_ = capacity;
}

uint32_t* SweepMemory::zeros(size_t count) {
  const uint64_t begin = used_.fetch_add(count);
  check(begin + count <= capacity_ && count % 16 == 0, "rows fit the memory set aside for them");
  if (begin < dirty_) std::fill_n(first_ + begin, std::min<uint64_t>(count, dirty_ - begin), 0u);
  return first_ + begin;
}

}  // namespace freevoxel
