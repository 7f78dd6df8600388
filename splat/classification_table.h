// The transfer function integrated over value: what a piece of a ray along which the value runs from one end to another
// contains on average, in two look-ups (pre-integrated classification, K. Engel et al. 2001).
#pragma once

#include <cstdint>
#include <vector>

#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// A place on the table: colour times extinction (linear RGB), and extinction in units of log2 per shortest voxel edge.
/// std430 alike (one vec4).
struct TableEntry {
  float red, green, blue, extinction;
};
static_assert(sizeof(TableEntry) == 16);

/// Table over the codes of a volume, `entriesPerCode` intervals to a code.
struct ClassificationTable {
  std::vector<TableEntry> integral;  ///< from code 0 to each entry, per interval; size intervals + 1
  std::vector<TableEntry> density;   ///< mean over the interval from each entry to the next; same size, last repeated
  float entriesPerCode = 1.0f;

  /// Mean extinction in log2 between two places on the table (code * entriesPerCode), without colour.
  float meanExtinction(float from, float to) const;
};

ClassificationTable classificationTable(const TransferFunction& transfer, const ValueCoding& coding);

}  // namespace freevoxel
