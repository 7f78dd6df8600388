// From blocks that may be seen to blocks that are: what every backend does before it draws cells.
#pragma once

#include <span>
#include <vector>

#include "splat/draw_cells.h"

namespace freevoxel {

/// A block about to be drawn, with its voxels.
struct ReadyBlock {
  VisibleBlock block;
  PixelBounds bounds;
  BlockSamples samples;
  bool drawn = true;  ///< false: nothing in it is visible, or it is hidden, or off the image
};

/// The blocks that may reach the image; the others are counted as culled.
std::vector<VisibleBlock> blocksOnImage(const CellFrame& frame, std::span<const VisibleBlock> blocks,
                                        CellCounts& counts);

/// Prepares the blocks with the source and gathers them into `ready`, which keeps its memory from call to call. Boxes
/// shrink to what is visible. Counts.
void readyBlocks(const CellFrame& frame, std::span<const VisibleBlock> blocks, std::vector<ReadyBlock>& ready,
                 CellCounts& counts);

/// Makes the block's box as small as what is visible in it allows; false if that is nothing. `visibility` is of the
/// codes of level 0.
bool shrinkToVisible(VisibleBlock& block, int edge, const BlockSamples& samples, const CodeVisibility& visibility);

}  // namespace freevoxel
