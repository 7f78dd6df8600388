#include "volume/paraview_colour_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "volume/merge_transfer.h"

namespace freevoxel {

namespace {

constexpr double kLargestValue = 1e300;

/// A list of equal records of numbers, sorted by the first, which is a value.
std::vector<std::vector<double>> readRecords(const JsonPlace& place, size_t numbers, const char* what) {
  place.size(numbers, std::numeric_limits<size_t>::max(), what);
  if (place.size() % numbers != 0) place.fail(std::string("expected ") + what);
  std::vector<std::vector<double>> records;
  for (size_t i = 0; i < place.size(); i += numbers) {
    std::vector<double> record{place.element(i).number(-kLargestValue, kLargestValue)};
    for (size_t k = 1; k < numbers; ++k)
      record.push_back(place.element(i + k).number(0.0, 1.0));
    if (!records.empty() && record[0] < records.back()[0]) place.element(i).fail("expected values in ascending order");
    if (records.size() >= 2 && record[0] == records[records.size() - 2][0]) {
      place.element(i).fail("expected at most two points (a step) of one value");
    }
    records.push_back(record);
  }
  return records;
}

std::vector<TransferPoint> readColours(const JsonPlace& map) {
  std::vector<TransferPoint> points;
  for (const auto& r : readRecords(map.member("RGBPoints"), 4, "records of value, red, green, blue")) {
    points.push_back({r[0], {r[1], r[2], r[3]}, 1.0});
  }
  return points;
}

std::vector<TransferPoint> readOpacities(const JsonPlace& map) {
  std::vector<TransferPoint> points;
  const JsonPlace place = map.member("Points");
  const auto records = readRecords(place, 4, "records of value, opacity, midpoint, sharpness");
  for (size_t i = 0; i < records.size(); ++i) {
    // The last record has no segment to bend.
    if (i + 1 < records.size() && (records[i][2] != 0.5 || records[i][3] != 0.0)) {
      place.element(4 * i + 2).fail("expected midpoint 0.5 and sharpness 0 (a straight line)");
    }
    points.push_back({records[i][0], {}, records[i][1]});
  }
  return points;
}

}  // namespace

bool isParaViewColourMap(const nlohmann::json& document) {
  return document.is_array();
}

TransferFunction readParaViewColourMap(const JsonPlace& document) {
  document.size(1, std::numeric_limits<size_t>::max(), "a list of colour maps");
  const JsonPlace map = document.element(0);
  if (map.has("ColorSpace") && map.value()["ColorSpace"] != "RGB") map.member("ColorSpace").fail("expected \"RGB\"");
  const std::vector<TransferPoint> colours = readColours(map);
  TransferFunction transfer;
  transfer.low = colours.front().value;
  transfer.high = colours.back().value;
  if (!(transfer.low < transfer.high)) map.member("RGBPoints").fail("expected a first value below the last");
  const std::vector<TransferPoint> opaque{{transfer.low, {}, 1.0}};
  transfer.points = mergePoints(colours, map.has("Points") ? readOpacities(map) : opaque);
  return transfer;
}

}  // namespace freevoxel
