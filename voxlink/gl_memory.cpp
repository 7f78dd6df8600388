#include "voxlink/gl_memory.h"

#include <algorithm>
#include <climits>

#include "base/error.h"
#include "gl/program.h"
#include "voxlink/gl_passes.h"

namespace freevoxel {

namespace {

/// llvmpipe crashes beyond this.
constexpr uint64_t kLargestSoftwareBuffer = uint64_t(1) << 31;
constexpr uint64_t kScanBlock = 256;

}  // namespace

GlMemory::GlMemory(const gl::Context& context, uint64_t limit) : limit_(limit) {
  GLint64 largest = 0;
  glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &largest);
  largestBuffer_ = largest > 0 ? uint64_t(largest) : uint64_t(INT_MAX);
  if (context.isSoftware()) largestBuffer_ = std::min(largestBuffer_, kLargestSoftwareBuffer);
}

gl::Buffer GlMemory::allocate(uint64_t bytes, const char* what) {
  bytes = (std::max(bytes, uint64_t(16)) + 3) / 4 * 4;
  if (bytes > largestBuffer_) {
    throw MachineError(
        fmt::format("VoxLink: {} takes {} MiB, more than the {} MiB that this driver can bind as one buffer; raise "
                    "--threshold, lower --resolution or use --backend cpu",
                    what, bytes >> 20, largestBuffer_ >> 20));
  }
  if (used_ + bytes > limit_) {
    throw MachineError(
        fmt::format("VoxLink: {} takes {} KiB of GPU memory beside {} KiB in use, more than the limit of {} KiB; raise "
                    "--gpu-memory or --threshold, lower --resolution or use --backend cpu",
                    what, (bytes + 1023) >> 10, used_ >> 10, limit_ >> 10));
  }
  while (glGetError() != GL_NO_ERROR) {
  }
  gl::Buffer buffer(bytes);
  if (glGetError() == GL_OUT_OF_MEMORY) {
    throw MachineError(fmt::format(
        "VoxLink: the GPU has no {} MiB left for {}; raise --threshold, lower --resolution or use --backend cpu",
        bytes >> 20, what));
  }
  used_ += bytes;
  return buffer;
}

void GlMemory::release(gl::Buffer& buffer) {
  used_ -= buffer.bytes();
  buffer = gl::Buffer();
}

PrefixSum::PrefixSum(GlMemory& memory)
    : memory_(memory),
      sumBlocks_(gl::makeProgram({"shaders/voxlink/sum_blocks.comp"})),
      addBlockSums_(gl::makeProgram({"shaders/voxlink/add_block_sums.comp"})) {}

void PrefixSum::run(const gl::Buffer& entries, uint64_t count) {
  const uint64_t blocks = (count + kScanBlock - 1) / kScanBlock;
  gl::Buffer sums = memory_.allocate(blocks * 8, "a prefix sum");
  bindStorage({&entries, &sums});
  glProgramUniform1ui(sumBlocks_.id(), 0, GLuint(count));
  dispatchMany(sumBlocks_, blocks);
  if (blocks > 1) {
    run(sums, blocks);
    bindStorage({&entries, &sums});
    glProgramUniform1ui(addBlockSums_.id(), 0, GLuint(count));
    dispatchMany(addBlockSums_, blocks);
  }
  glFinish();  // before the buffer of sums goes
  memory_.release(sums);
}

}  // namespace freevoxel
