// ImageVis3D's one-dimensional transfer functions (.1dt).
#pragma once

#include <string>

#include "volume/transfer_function.h"

namespace freevoxel {

/// A count and that many lines "red green blue opacity", each 0..1. Entry i stands for value i, over [0, count - 1];
/// opacity per voxel edge. Throws InputError with the line.
TransferFunction parseImageVis3dTable(const std::string& text, const std::string& name);

}  // namespace freevoxel
