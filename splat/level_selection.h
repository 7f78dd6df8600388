// Which blocks a view needs: the cut through the hierarchy (papers/freevoxels section 4.4).
#pragma once

#include <span>
#include <vector>

#include "splat/visible_blocks.h"
#include "splat/volume_view.h"

namespace freevoxel {

/// Blocks of the coarsest level whose voxels are nowhere in the block larger than `pixels` on the image, those of the
/// finest level where there is none: coarsest level first, each along the curve. They tile the volume. `levels[k]`: the
/// blocks of level k, edges of `edge` voxels; every block's parent is there. Blocks off the image are not refined.
/// Depends on nothing but its arguments, so every process makes the same cut.
std::vector<VisibleBlock> selectBlocks(std::span<const std::vector<VisibleBlock>> levels, int edge,
                                       const VolumeView& view, double pixels);

/// The blocks of the next finer level that stand for the same part of the volume as `block`.
class BlockChildren {
 public:
  /// `finer`: all blocks of a level; must outlive this.
  BlockChildren(std::span<const VisibleBlock> finer, int edge);
  /// Numbers in `finer`.
  std::vector<size_t> of(const VisibleBlock& block) const;

 private:
  std::vector<std::pair<uint64_t, size_t>> numbers_;  ///< sorted by place
  int edge_;
};

/// The largest size of the block's voxels on the image, in pixels: that of the longest edge at the place nearest to the
/// eye, infinite where the block reaches behind the eye's plane.
double largestVoxel(const VisibleBlock& block, int edge, const VolumeView& view);

}  // namespace freevoxel
