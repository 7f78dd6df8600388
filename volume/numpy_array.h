// NumPy arrays (.npy).
#pragma once

#include "volume/file_start.h"
#include "volume/payload.h"

namespace freevoxel {

bool isNumpyArray(const FileStart& start);

/// Versions 1 to 3 of the format; the axes are [z][y][x] whichever of them is contiguous. Of a fourth axis,
/// options.component takes the last and options.frame the first. Throws InputError with the offset.
Payload readNumpyHeader(const FileStart& start, const VolumeOptions& options);

/// How many axes an array has. Throws InputError with the offset.
size_t numpyAxes(const FileStart& start);

/// An array of two axes, [row][column].
struct NumpyTable {
  uint64_t rows = 0, columns = 0;  ///< as the file says, 0 and absurd ones included
  StoredType type = StoredType::f32;
  ByteOrder byteOrder = ByteOrder::little;
  bool columnsFirst = false;  ///< the values run through rows first
  size_t bytesBefore = 0;     ///< the first value
};

/// Throws InputError with the offset.
NumpyTable readNumpyTable(const FileStart& start);

}  // namespace freevoxel
