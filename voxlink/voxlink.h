// A volume in per-voxel lists, traced: VoxLink (papers/voxlink sections 3 to 5.1; docs/voxlink.md).
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/camera.h"
#include "base/image.h"
#include "base/light.h"
#include "base/progress.h"
#include "gl/context.h"
#include "hierarchy/value_grid.h"
#include "volume/transfer_function.h"
#include "voxlink/image_rows.h"
#include "voxlink/shadows.h"

namespace freevoxel {

struct VoxLinkOptions {
  int brickEdge = 8;       ///< voxels: 4, 8 or 16
  double threshold = 0.0;  ///< voxels of more opacity (per reference length) are stored; 0 <= threshold < 1
  int steps = 512;         ///< of a ray per pass on the GPU, 1 to GlVoxLink::kMostSteps
  uint64_t gpuMemory = uint64_t(4) << 30;  ///< bytes that may be allocated there
};

struct VoxLinkStatistics {
  std::string backend;     ///< "gl" or "cpu"
  std::string glRenderer;  ///< empty for cpu
  uint64_t voxels = 0;     ///< of the volume
  uint64_t storedVoxels = 0;
  uint64_t bricks = 0;  ///< of the grid over the stored voxels
  uint64_t occupiedBricks = 0;
  uint64_t bufferBytes = 0;  ///< of everything that tracing without lamps reads
  int builds = 0;            ///< how often the buffers were built
  int passes = 0;            ///< of the last picture
  double buildSeconds = 0, shadowSeconds = 0, lightSeconds = 0, traceSeconds = 0;  ///< sums over all calls
};

/// One volume under transfer functions that may change. Move-only.
class VoxLink {
 public:
  /// `grid` must outlive it. Without a context everything is done by plain C++; with one, which must be current and
  /// outlive it, by compute passes. Throws InputError (options, nothing to store) or MachineError (GPU memory).
  VoxLink(const ValueGrid& grid, const TransferFunction& transfer, const VoxLinkOptions& options,
          const gl::Context* context, Progress& progress);
  ~VoxLink();
  VoxLink(VoxLink&& other) noexcept;
  VoxLink& operator=(VoxLink&&) = delete;

  /// Another transfer function. If all that it shows is stored only materials change; if it shows voxels that were
  /// left out, or has another range, the buffers are built anew. `grid` is the same volume coded for it. Throws as
  /// above.
  void edit(const ValueGrid& grid, const TransferFunction& transfer, Progress& progress);

  /// Lamps, once for many pictures: what of their light reaches each voxel. Throws InputError or MachineError.
  void light(const Lighting& lighting, Shadows shadows);

  /// Premultiplied linear RGBA, see traceRays. Both backends agree within what floats lose.
  Image trace(const Camera& camera, Progress& progress) { return trace(camera, allRows(camera), progress); }
  /// Rows of it; of every partition of an image they have the same bits.
  Image trace(const Camera& camera, ImageRows rows, Progress& progress);

  const VoxLinkStatistics& statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace freevoxel
