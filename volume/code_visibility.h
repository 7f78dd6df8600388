// Which ranges of value codes hold something visible, in constant time.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// Answers for codes what TransferFunction::largestOpacity answers for values.
class CodeVisibility {
 public:
  CodeVisibility(const TransferFunction& transfer, const ValueCoding& coding);

  bool voxel(uint32_t code) const { return visible_[code] != 0; }
  /// Whether any value from that of `low` to that of `high` is visible, low <= high.
  bool between(uint32_t low, uint32_t high) const {
    return low == high ? visible_[low] != 0 : nextVisible_[low] < high;
  }

 private:
  std::vector<uint8_t> visible_;
  std::vector<uint32_t> nextVisible_;  ///< first c >= code with opacity somewhere from c to c + 1
};

}  // namespace freevoxel
