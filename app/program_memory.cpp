#include "app/program_memory.h"

#include <malloc.h>
#include <omp.h>
#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "base/address_sanitizer.h"

namespace freevoxel {

namespace {

constexpr uint64_t kMebibyte = uint64_t(1) << 20;
/// Where nothing says more, and under the address sanitizer, which maps terabytes that are not the program's.
constexpr uint64_t kUsualProgram = 64 * kMebibyte;
/// A thread's heap and what compression keeps there.
constexpr uint64_t kThreadHeap = 2 * kMebibyte;
/// Tables of the curve, the page that sweeps are aligned to while they are mapped, the progress bar, what the C library
/// keeps.
constexpr uint64_t kElse = 6 * kMebibyte;

uint64_t claimedBytes() {
  if (kUnderAddressSanitizer) return kUsualProgram;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmData:", 0) == 0) return std::stoull(line.substr(7)) * 1024;
  }
  return kUsualProgram;
}

uint64_t stackBytes() {
  rlimit limit{};
  constexpr uint64_t kUsual = 8 * kMebibyte;
  return getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY ? uint64_t(limit.rlim_cur) : kUsual;
}

}  // namespace

uint64_t memoryForData(uint64_t memoryBytes, uint64_t libraryBytes) {
  // Else the C library moves the size from which on arrays are mapped up to that of the first one that goes, and later
  // ones leave holes in the heap.
  constexpr int kMappedFrom = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  const auto threads = uint64_t(omp_get_max_threads());
  const uint64_t program = claimedBytes() + libraryBytes + (threads - 1) * stackBytes() + threads * kThreadHeap + kElse;
  return std::max(memoryBytes / 16, memoryBytes - std::min(memoryBytes, program));
}

}  // namespace freevoxel
