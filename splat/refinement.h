// How a coarse picture becomes a fine one, block by block: sums that are exact can be taken back (docs/fidelity.md).
#pragma once

#include <span>
#include <vector>

#include "splat/visible_blocks.h"
#include "splat/volume_view.h"

namespace freevoxel {

/// Blocks of one level make way for those of the next finer one.
struct RefinementStep {
  std::vector<VisibleBlock> removed, added;
};

struct Refinement {
  std::vector<VisibleBlock> first;  ///< the coarsest level
  std::vector<RefinementStep> steps;
};

/// From the coarsest of `levels` (stored blocks of each, finest first, along the Hilbert curve) to `cut`, which holds
/// every stored place once. Level by level, and of a level what is near to the eye first, since what is hidden changes
/// little; the finer the level, the more steps it takes: eight or more in all, if there are blocks enough.
Refinement refinementTo(std::span<const VisibleBlock> cut, std::span<const std::vector<VisibleBlock>> levels, int edge,
                        const VolumeView& view);

}  // namespace freevoxel
