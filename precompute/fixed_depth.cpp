#include "precompute/fixed_depth.h"

#include <cmath>

namespace freevoxel {

FixedDepth fixedDepth(double sigma) {
  return roundedDepth(sigma / std::log(2.0) * kDepthUnitsPerLog2);
}

}  // namespace freevoxel
