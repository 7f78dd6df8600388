// Backends of the cell footprint: blocks in, six sums out.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/image.h"
#include "gl/context.h"
#include "splat/attenuation_grid.h"
#include "splat/block_source.h"
#include "splat/cell_block.h"
#include "splat/classification_table.h"
#include "splat/pixel_rays.h"
#include "splat/sums.h"
#include "splat/volume_view.h"
#include "volume/code_visibility.h"

namespace freevoxel {

/// What all blocks of a frame share. Everything pointed to must outlive the drawing.
struct CellFrame {
  BlockSource* source = nullptr;
  const ClassificationTable* table = nullptr;
  const VolumeView* view = nullptr;
  const std::vector<PixelRay>* rays = nullptr;
  const CodeVisibility* visibility = nullptr;  ///< of codes of level 0
  float inverseQuantum = 0x1p20f;
  float hiddenBelow = 0.0f;              ///< rays end where attenuation falls below this
  bool everything = false;               ///< also what adds nothing: every block is traced whole, by every pixel
  float hiddenBlocksBelow = 0.0f;        ///< blocks are left out where it is below this everywhere
  std::function<void(size_t)> advanced;  ///< told how many more blocks are done, from the thread that draws
};

struct CellCounts {
  uint64_t blocks = 0;                  ///< drawn
  std::vector<uint64_t> blocksOfLevel;  ///< of these, at each level
  uint64_t culledBlocks = 0;            ///< off the image
  uint64_t hiddenBlocks = 0;
  uint64_t emptyBlocks = 0;    ///< nothing in them is visible
  uint64_t fragments = 0;      ///< pixels that the blocks' bounding rectangles cover
  uint64_t pieces = 0;         ///< of rays between two planes of voxels, traced; not counted by gl
  uint64_t visiblePieces = 0;  ///< of these, in which something is visible
};

/// Adds blocks to sums that start at zero. Each block gives each pixel one contribution, rounded to whole quanta, so
/// the sums do not depend on order or grouping as long as they stay exact (sumsAreExact).
class CellCanvas {
 public:
  virtual ~CellCanvas() = default;
  virtual void clear() = 0;
  /// Prepares the blocks itself, as many at a time as fit what the canvas may take.
  virtual void draw(const CellFrame& frame, std::span<const VisibleBlock> blocks, CellCounts& counts) = 0;
  /// kSumChannels channels in whole quanta: light in quanta of the frame, depth in 2^-6 and 2^-16. Takes them out: the
  /// canvas is of no use until the next clear().
  virtual Image wholeQuanta() = 0;
};

/// Plain C++ with OpenMP. `blocksAtATime`: whose voxels are held at once, at least 1.
std::unique_ptr<CellCanvas> makeCpuCellCanvas(glm::ivec2 imageSize, size_t blocksAtATime);
/// Bytes that the canvas takes for each block held.
uint64_t cpuCanvasBytes(int edge);

/// One rectangle per block, traced in the fragment shader, blended into float framebuffers. `context` must be current
/// and outlive the canvas. Buffers and textures take no more than `bytes`; blocks pass through two buffers of one size,
/// one filled while the other is drawn. Throws MachineError if that is too little, or the driver lacks what it takes.
std::unique_ptr<CellCanvas> makeGlCellCanvas(gl::Context& context, glm::ivec2 imageSize, size_t blocksAtATime,
                                             uint64_t bytes);

}  // namespace freevoxel
