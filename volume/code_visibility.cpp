#include "volume/code_visibility.h"

#include <limits>

namespace freevoxel {

CodeVisibility::CodeVisibility(const TransferFunction& transfer, const ValueCoding& coding)
    : visible_(coding.largest + 1), nextVisible_(coding.largest + 1, std::numeric_limits<uint32_t>::max()) {
  for (uint32_t code = coding.largest + 1; code-- > 0;) {
    const double value = coding.decode(code);
    visible_[code] = transfer.largestOpacity(value, value) > 0.0;
    if (code == coding.largest) continue;
    const bool visible = transfer.largestOpacity(value, coding.decode(code + 1)) > 0.0;
    nextVisible_[code] = visible ? code : nextVisible_[code + 1];
  }
}

}  // namespace freevoxel
