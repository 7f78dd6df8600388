// How much of --memory is left for data.
#pragma once

#include <cstdint>

namespace freevoxel {

/// What is left of `memoryBytes`, the most private memory that the process may claim (RLIMIT_DATA, VmData): less what
/// it has claimed so far, which is libraries and the stacks of their threads, and less the stacks, heaps and tables
/// that OpenMP's threads will want. At least a sixteenth. From the call on, large arrays are given back to the system
/// when they go.
uint64_t memoryForData(uint64_t memoryBytes);

}  // namespace freevoxel
