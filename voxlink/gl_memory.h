// GPU memory within a limit, and prefix sums in it.
#pragma once

#include <cstdint>

#include "gl/context.h"
#include "gl/objects.h"

namespace freevoxel {

/// Hands out buffers. Every allocation is checked first against the limit and against what the driver can bind:
/// MachineError says how much would have been needed.
class GlMemory {
 public:
  /// `limit`: bytes that all buffers together may take.
  GlMemory(const gl::Context& context, uint64_t limit);
  /// `what` stands in errors.
  gl::Buffer allocate(uint64_t bytes, const char* what);
  void release(gl::Buffer& buffer);

 private:
  uint64_t limit_, largestBuffer_, used_ = 0;
};

/// Replaces pairs of uint32 by the sums of those before them.
class PrefixSum {
 public:
  explicit PrefixSum(GlMemory& memory);
  /// The first `count` pairs of a buffer; done when it returns.
  void run(const gl::Buffer& entries, uint64_t count);

 private:
  GlMemory& memory_;
  gl::Program sumBlocks_, addBlockSums_;
};

}  // namespace freevoxel
