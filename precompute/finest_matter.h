// What voxels of the finest level are made of on average, as far as coarser levels are concerned.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/level_matter.h"
#include "volume/code_visibility.h"
#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// The box of a voxel, halved along each axis: values are interpolated at the eight middles and classified there, as
/// pictures of the finest level classify after interpolation. A voxel's own value alone would miss what the transfer
/// function shows between two voxels, such as the skin between air and flesh. Of labels, which nothing lies between, it
/// is the voxel's own.
class FinestMatter {
 public:
  /// Codes of 4 x 4 x 4 voxels, x fastest.
  using Codes = std::array<uint16_t, 64>;

  FinestMatter(const TransferFunction& transfer, const ValueCoding& coding);

  /// Means of matter over the boxes of the middle 2 x 2 x 2, x fastest. False, and `matter` as it was, if nothing is
  /// visible there.
  bool ofEight(const Codes& codes, std::array<LevelMatter, 8>& matter) const;

 private:
  CodeVisibility visibility_;
  bool labels_;
  int shift_ = 0;  ///< from places, 64 to a code, to entries of the table
  std::vector<LevelMatter> table_;
};

}  // namespace freevoxel
