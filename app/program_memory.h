// How much of --memory is left for data.
#pragma once

#include <cstdint>

namespace freevoxel {

/// What the libraries claim that come with the first image file (base/image_library.h): measured, 109 MB.
inline constexpr uint64_t kImageLibraryBytes = uint64_t(112) << 20;

/// What is left of `memoryBytes`, the most private memory that the process may claim (RLIMIT_DATA, VmData): less what
/// it has claimed so far, which is libraries and the stacks of their threads, and less the stacks, heaps and tables
/// that OpenMP's threads will want, and less `libraryBytes`, which libraries will claim that are not loaded yet. At
/// least a sixteenth. From the call on, large arrays are given back to the system when they go.
uint64_t memoryForData(uint64_t memoryBytes, uint64_t libraryBytes = 0);

}  // namespace freevoxel
