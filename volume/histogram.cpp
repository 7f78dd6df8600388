#include "volume/histogram.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace freevoxel {

Histogram histogramOf(const Volume& volume, size_t parts) {
  check(parts >= 1, "a histogram has at least one part");
  const ValueStatistics figures = valueStatistics(volume);
  Histogram histogram{.low = figures.low, .high = figures.high, .counts = std::vector<uint64_t>(parts)};
  if (!isFloatingPoint(volume.header.type) && figures.high - figures.low < double(parts)) {
    histogram.low -= 0.5;
    histogram.high += 0.5;
    histogram.counts.resize(size_t(histogram.high - histogram.low));
  } else if (!(figures.low < figures.high)) {
    histogram.counts.resize(1);
  }
  // Divided before subtracting: the difference of two finite numbers may be infinite.
  const auto count = double(histogram.counts.size());
  const double extent = histogram.high / count - histogram.low / count;
  withValues(volume, [&](const auto* values) {
    for (uint64_t i = 0; i < volume.header.voxels(); ++i) {
      const auto value = double(values[i]);
      if (!std::isfinite(value)) continue;
      const double part = extent > 0.0 ? (value - histogram.low) / extent : 0.0;
      ++histogram.counts[std::min(size_t(std::max(part, 0.0)), histogram.counts.size() - 1)];
      ++histogram.total;
    }
  });
  return histogram;
}

}  // namespace freevoxel
