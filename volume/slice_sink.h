// Where the readers that use libraries put what they read.
#pragma once

#include <cstddef>
#include <span>

#include "volume/child_reader.h"
#include "volume/volume.h"

namespace freevoxel {

class SliceSink {
 public:
  virtual ~SliceSink() = default;
  /// Once, before any values.
  virtual void header(const VolumeHeader& header) = 0;
  /// The next values, in the volume's order, this machine's byte order; whole volume in all.
  virtual void values(std::span<const std::byte> bytes) = 0;
};

// Run in a child only. Each throws InputError naming the file.

/// TIFF, multi-page TIFF, PNG, EXR through OpenImageIO: a slice per file, or a slice per page of one file. A pixel's
/// row is y, downwards. Spacing 1.
void readImageStack(const LibraryRequest& request, SliceSink& sink);

/// The files of one DICOM series, in any order, or one file with several frames, through GDCM. Sorted along the normal
/// of the slices, whose distance comes from their positions; a gantry's tilt shears the volume. Stored values are
/// rescaled as the files say: whole numbers stay so where slope and intercept are.
void readDicom(const LibraryRequest& request, SliceSink& sink);

/// One grid of an OpenVDB file, the box of its active voxels, through OpenVDB: outside them the background, of a level
/// set its sign.
void readVdb(const LibraryRequest& request, SliceSink& sink);

/// The one of them that the request's format asks for.
void readWithLibrary(const LibraryRequest& request, SliceSink& sink);

}  // namespace freevoxel
