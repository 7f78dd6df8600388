// A picture from bands of its rows, one per rank.
#pragma once

#include "base/image.h"
#include "parallel/ranks.h"

namespace freevoxel {

/// Collective. `band` is this rank's; all are as wide and have as many channels, heights may differ and be 0. Rank 0
/// gets them one below the other, the others an empty image. Without a launcher the band itself comes back.
Image gatherRows(const Ranks& ranks, Image band);

}  // namespace freevoxel
