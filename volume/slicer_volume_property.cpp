#include "volume/slicer_volume_property.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "volume/merge_transfer.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

/// The numbers of a line that begins with how many there are.
std::vector<double> countedNumbers(std::string_view line, const std::string& where, size_t record) {
  std::vector<double> numbers;
  for (const std::string_view word : words(line)) {
    const double number = parseNumber<double>(word).value_or(NAN);
    if (!(std::abs(number) <= 1e300))
      throw InputError(fmt::format("{}: expected a number, found {}", where, inQuotes(word)));
    numbers.push_back(number);
  }
  if (numbers.size() < 1 + record || numbers[0] != double(numbers.size() - 1) || (numbers.size() - 1) % record != 0) {
    throw InputError(fmt::format("{}: expected a count and that many numbers, {} for each point, found {}", where,
                                 record, inQuotes(line)));
  }
  numbers.erase(numbers.begin());
  return numbers;
}

/// Points of a line, sorted by value, at most two of one value.
std::vector<TransferPoint> readPoints(const std::vector<double>& numbers, size_t record, const std::string& where) {
  std::vector<TransferPoint> points;
  for (size_t i = 0; i < numbers.size(); i += record) {
    for (size_t k = 1; k < record; ++k) {
      if (numbers[i + k] < 0.0 || numbers[i + k] > 1.0) {
        throw InputError(fmt::format("{}: expected colours and opacities in 0..1, found {}", where, numbers[i + k]));
      }
    }
    TransferPoint point{numbers[i], glm::dvec3(0.0), 0.0};
    if (record == 2) {
      point.opacity = numbers[i + 1];
    } else {
      point.srgb = {numbers[i + 1], numbers[i + 2], numbers[i + 3]};
    }
    if (!points.empty() && point.value < points.back().value) {
      throw InputError(fmt::format("{}: expected values in ascending order, found {} after {}", where, point.value,
                                   points.back().value));
    }
    if (points.size() >= 2 && points[points.size() - 2].value == point.value) points.pop_back();
    points.push_back(point);
  }
  return points;
}

}  // namespace

TransferFunction parseSlicerVolumeProperty(const std::string& text, const std::string& name) {
  // Interpolation, shading, diffuse, ambient, specular, power; opacity of values; of gradients; colours.
  constexpr size_t kLines = 9, kOpacity = 6, kColour = 8;
  std::vector<std::string_view> lines;
  for (size_t next = 0; next < text.size() && lines.size() < kLines;) {
    const size_t end = std::min(text.find('\n', next), text.size());
    lines.push_back(std::string_view(text).substr(next, end - next));
    next = end + 1;
  }
  if (lines.size() < kLines) {
    throw InputError(fmt::format("{}: expected {} lines of a volume property, found {}", name, kLines, lines.size()));
  }
  const auto where = [&](size_t line) { return fmt::format("{}: line {}", name, line + 1); };
  TransferFunction opacities, colours;
  opacities.points = readPoints(countedNumbers(lines[kOpacity], where(kOpacity), 2), 2, where(kOpacity));
  colours.points = readPoints(countedNumbers(lines[kColour], where(kColour), 4), 4, where(kColour));
  TransferFunction transfer;
  transfer.low = std::min(opacities.points.front().value, colours.points.front().value);
  transfer.high = std::max(opacities.points.back().value, colours.points.back().value);
  if (!(transfer.low < transfer.high)) throw InputError(fmt::format("{}: all points have one value", name));
  transfer.points = mergePoints(colours.points, opacities.points);
  return transfer;
}

}  // namespace freevoxel
