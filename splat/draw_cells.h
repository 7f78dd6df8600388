// Backends of the cell footprint: blocks in, six sums out.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "base/image.h"
#include "gl/context.h"
#include "splat/cell_block.h"
#include "splat/classification_table.h"
#include "splat/pixel_rays.h"
#include "splat/sums.h"
#include "splat/visible_blocks.h"
#include "splat/volume_view.h"

namespace freevoxel {

/// What all blocks of a frame share. Everything pointed to must outlive the drawing.
struct CellFrame {
  const ValueGrid* grid = nullptr;
  const AttenuationGrid* attenuation = nullptr;
  const LightGrid* light = nullptr;  ///< empty = unlit
  const ClassificationTable* table = nullptr;
  const VolumeView* view = nullptr;
  const std::vector<PixelRay>* rays = nullptr;
  int edge = 16;  ///< of blocks, voxels
  float inverseQuantum = 0x1p20f;
  float hiddenBelow = 0.0f;  ///< rays end where attenuation falls below this
};

struct CellCounts {
  uint64_t blocks = 0, culledBlocks = 0;
  uint64_t fragments = 0;  ///< pixels that the blocks' bounding rectangles cover
  uint64_t pieces = 0;     ///< of rays between two planes of voxels, traced; not counted by gl
};

/// Adds blocks to sums that start at zero. Each block gives each pixel one contribution, rounded to whole quanta, so
/// the sums do not depend on order or grouping as long as they stay exact (sumsAreExact).
class CellCanvas {
 public:
  virtual ~CellCanvas() = default;
  virtual void clear() = 0;
  virtual void draw(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) = 0;
  /// kSumChannels channels in whole quanta: light in quanta of the frame, depth in 2^-6 and 2^-16. Takes them out: the
  /// canvas is of no use until the next clear().
  virtual Image wholeQuanta() = 0;
};

/// Plain C++ with OpenMP.
std::unique_ptr<CellCanvas> makeCpuCellCanvas(glm::ivec2 imageSize);

/// One rectangle per block, traced in the fragment shader, blended into float framebuffers. `context` must be current
/// and outlive the canvas. Throws MachineError if the driver lacks what it takes.
std::unique_ptr<CellCanvas> makeGlCellCanvas(gl::Context& context, glm::ivec2 imageSize);

}  // namespace freevoxel
