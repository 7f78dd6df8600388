// MetaImage: .mha (header and values) and .mhd (header, values elsewhere).
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isMetaImage(const FileStart& start);

/// Values raw, zlib or text; in the same file, one file, a list of files or a numbered series. Its world is LPS, as in
/// ITK and 3D Slicer. A fourth dimension is chosen from by options.frame, channels by options.component.
/// CompressedDataSize is not believed. Throws InputError with the line.
Payload readMetaImageHeader(const FileStart& start, const VolumeOptions& options);

}  // namespace freevoxel
