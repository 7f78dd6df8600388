// How often values occur.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/volume.h"

namespace freevoxel {

/// Counts of finite values in equal parts of [low, high], the volume's smallest and largest; the last part includes
/// high. Whole numbers that span no more than `parts` have a part each, in [low - 0.5, high + 0.5].
/// Invariant: counts.size() >= 1; low < high unless all values are equal, when there is one part.
struct Histogram {
  double low = 0.0, high = 0.0;
  std::vector<uint64_t> counts;
  uint64_t total = 0;  ///< of counts

  double width() const { return (high - low) / double(counts.size()); }
  /// Middle of a part, in data units.
  double middle(size_t part) const { return low + (double(part) + 0.5) * width(); }
};

/// At most `parts` parts, parts >= 1.
Histogram histogramOf(const Volume& volume, size_t parts);

}  // namespace freevoxel
