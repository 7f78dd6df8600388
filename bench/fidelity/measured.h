// Distances of several pictures from their references, put together.
#pragma once

#include <cmath>
#include <string>

#include "base/compare.h"

namespace freevoxel::bench {

/// Pooled over pictures: covered pixels of all of them count alike.
class Measured {
 public:
  void add(const ImageDifference& difference);
  double pooled() const;  ///< PSNR, dB
  double worst() const { return worst_; }
  /// "57.4 (56.1)": pooled, and the worst picture.
  std::string text() const;

 private:
  double squares_ = 0.0;
  uint64_t pixels_ = 0;
  double worst_ = INFINITY;
};

}  // namespace freevoxel::bench
