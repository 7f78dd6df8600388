// 3D Slicer's volume properties (.vp).
#pragma once

#include <string>

#include "volume/transfer_function.h"

namespace freevoxel {

/// The lines "scalar opacity" and "colour" of a volume property, over the range that both cover; opacity per voxel
/// edge. Shading and gradient opacity are passed over. Throws InputError with the line.
TransferFunction parseSlicerVolumeProperty(const std::string& text, const std::string& name);

}  // namespace freevoxel
