// Precompute shared by the ranks of a run (DESIGN section 6): a slab of the volume for each, one file.
#pragma once

#include <string>

#include "parallel/ranks.h"
#include "precompute/precompute.h"

namespace freevoxel {

/// precompute() of a SlabTeam that is `ranks`: collective, all with the same arguments. Throws RankFailed where another
/// rank has failed.
PrecomputeResult precompute(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, const Ranks& ranks, Progress& progress);

}  // namespace freevoxel
