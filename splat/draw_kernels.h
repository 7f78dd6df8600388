// Backends of the kernel footprint: splats in, six sums out.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/image.h"
#include "gl/context.h"
#include "splat/kernel_splats.h"

namespace freevoxel {

/// Adds splats to sums that start at zero. All implementations give the same bits for the same splats in any order and
/// any grouping, as long as the sums stay exact (sumsAreExact).
class KernelCanvas {
 public:
  virtual ~KernelCanvas() = default;
  virtual void clear() = 0;
  virtual void draw(std::span<const KernelSplat> splats) = 0;
  /// kSumChannels channels in whole quanta: light in quanta of the setup, depth in 2^-6 and 2^-16.
  virtual Image wholeQuanta() = 0;
};

/// Plain C++ with OpenMP, one tile of the image per task.
std::unique_ptr<KernelCanvas> makeCpuKernelCanvas(glm::ivec2 imageSize);

/// Points (and rectangles where points would be too large) blended into float framebuffers. `context` must be current
/// and outlive the canvas. Throws MachineError if the driver lacks what it takes.
std::unique_ptr<KernelCanvas> makeGlKernelCanvas(gl::Context& context, glm::ivec2 imageSize);

}  // namespace freevoxel
