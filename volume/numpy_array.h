// NumPy arrays (.npy).
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isNumpyArray(const FileStart& start);

/// Versions 1 to 3 of the format; the axes are [z][y][x] whichever of them is contiguous. Of a fourth axis,
/// options.component takes the last and options.frame the first. Throws InputError with the offset.
Payload readNumpyHeader(const FileStart& start, const VolumeOptions& options);

}  // namespace freevoxel
