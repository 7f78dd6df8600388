// What the composite costs, without the ranks to do it: bytes are counted from what the ranks cover, times come from
// rates measured on this machine. For virtual ranks (freevoxel speedup) and for docs/scaling.md.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "parallel/ranks.h"

namespace freevoxel {

/// Bytes of an image per second and core.
struct CompositeRates {
  double pack = 0.0;      ///< finding covered tiles, and copying them
  double add = 0.0;       ///< adding tiles that have arrived
  double transfer = 0.0;  ///< between two ranks of this machine: a copy in memory
};

/// Measured on an image of `imageSize` in which everything is covered: medians of several runs.
CompositeRates measureCompositeRates(glm::ivec2 imageSize, int channels);

/// Which tiles (kCompositeTile) of an image hold anything.
std::vector<uint8_t> coveredCompositeTiles(const Image& image);

struct CompositeCost {
  double sentBytes = 0.0;      ///< by a rank that is not rank 0, the one that covers most
  double gatheredBytes = 0.0;  ///< by rank 0, in the end
  double seconds = 0.0;        ///< of the slowest rank, all rounds and the gathering; latency left out
};

/// Of the tree that Compositor takes. `coveredTiles`: of the rank that covers most; `unionTiles`: of the whole picture,
/// which bounds what any rank holds after the first round; `tiles`: all.
CompositeCost compositeCost(int rankCount, uint64_t tiles, uint64_t coveredTiles, uint64_t unionTiles, int channels,
                            const CompositeRates& rates);

}  // namespace freevoxel
