#include "volume/merge_transfer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace freevoxel {

std::vector<TransferPoint> mergePoints(const std::vector<TransferPoint>& colourPoints,
                                       const std::vector<TransferPoint>& opacityPoints) {
  constexpr double kEverything = 1e300;
  TransferFunction colours{.low = -kEverything, .high = kEverything, .points = colourPoints};
  TransferFunction opacities{.low = -kEverything, .high = kEverything, .points = opacityPoints};
  std::vector<double> values;
  for (const auto* side : {&colours, &opacities}) {
    for (const TransferPoint& point : side->points)
      values.push_back(point.value);
  }
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  const auto below = [](double value) { return std::nextafter(value, -std::numeric_limits<double>::infinity()); };
  std::vector<TransferPoint> merged;
  for (const double value : values) {
    const auto isStep = [value](const TransferFunction& side) {
      return std::count_if(side.points.begin(), side.points.end(), [&](const auto& p) { return p.value == value; }) ==
             2;
    };
    if (isStep(colours) || isStep(opacities)) {
      merged.push_back({value, colours.srgbAt(below(value)), opacities.opacityAt(below(value))});
    }
    merged.push_back({value, colours.srgbAt(value), opacities.opacityAt(value)});
  }
  return merged;
}

}  // namespace freevoxel
