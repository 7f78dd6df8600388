// Legacy VTK files (.vtk) of structured points.
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isLegacyVtk(const FileStart& start);

/// BINARY (big-endian) or ASCII. Every array of the file is gone through, so that a file cut short is found whichever
/// is chosen. options.component names an array, or "name.1" one of its components; without it the first SCALARS of one
/// component are taken. Point data, or where there are none, cell data (a voxel is then a cell's centre).
/// Throws InputError with the offset.
Payload readLegacyVtkHeader(const FileStart& start, const VolumeOptions& options);

}  // namespace freevoxel
