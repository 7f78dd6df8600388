// Colours and opacities that files keep apart, in one transfer function.
#pragma once

#include <vector>

#include "volume/transfer_function.h"

namespace freevoxel {

/// Corners of both lists, sorted by value, at least one each: each takes what it lacks from the other.
std::vector<TransferPoint> mergePoints(const std::vector<TransferPoint>& colours,
                                       const std::vector<TransferPoint>& opacities);

}  // namespace freevoxel
