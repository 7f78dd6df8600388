#include "volume/transfer_presets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <span>

#include "base/error.h"
#include "volume/histogram.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

/// Range of a volume's values, never empty.
struct Range {
  double low, high;
  double at(double t) const { return std::lerp(low, high, t); }
};

Range rangeOf(const Volume& volume) {
  const ValueStatistics figures = valueStatistics(volume);
  Range range{figures.low, figures.high};
  if (!(range.low < range.high)) range.high = range.low + std::max(1.0, std::abs(range.low));
  return range;
}

TransferFunction overRange(Range range, std::vector<TransferPoint> points) {
  TransferFunction transfer;
  transfer.low = range.low;
  transfer.high = range.high;
  transfer.points = std::move(points);
  // What lies below the range's end must come before what lies above.
  std::stable_sort(transfer.points.begin(), transfer.points.end(),
                   [](const TransferPoint& a, const TransferPoint& b) { return a.value < b.value; });
  // Two points of one value are a step; those between them mean nothing.
  auto& all = transfer.points;
  for (size_t i = 2; i < all.size();) {
    if (all[i].value == all[i - 2].value) {
      all.erase(all.begin() + ptrdiff_t(i - 1));
    } else {
      ++i;
    }
  }
  return transfer;
}

/// Finite values on the surface of the box, sorted.
std::vector<double> surfaceValues(const Volume& volume) {
  const glm::ivec3 dims = volume.header.dims;
  std::vector<double> values;
  for (int z = 0; z < dims.z; ++z) {
    const bool whole = z == 0 || z == dims.z - 1;
    for (int y = 0; y < dims.y; ++y) {
      const bool row = whole || y == 0 || y == dims.y - 1;
      for (int x = 0; x < dims.x; x += row ? 1 : std::max(1, dims.x - 1)) {
        const double value = volume.value(linearIndex({x, y, z}, dims));
        if (std::isfinite(value)) values.push_back(value);
      }
    }
  }
  std::sort(values.begin(), values.end());
  return values;
}

double quantile(const std::vector<double>& sorted, double q) {
  return sorted.empty() ? 0.0 : sorted[size_t(q * double(sorted.size() - 1) + 0.5)];
}

/// Values of a side of the background, from it outwards: how far the given shares of them reach.
std::vector<double> reaches(const Histogram& histogram, double background, double noise, bool above,
                            std::span<const double> shares) {
  const size_t parts = histogram.counts.size();
  const auto outside = [&](size_t part) {
    const double value = histogram.middle(part);
    return above ? value > background + noise : value < background - noise;
  };
  uint64_t all = 0;
  for (size_t part = 0; part < parts; ++part)
    all += outside(part) ? histogram.counts[part] : 0;
  std::vector<double> found;
  uint64_t passed = 0;
  for (size_t i = 0; i < parts; ++i) {
    const size_t part = above ? i : parts - 1 - i;
    if (!outside(part)) continue;
    passed += histogram.counts[part];
    while (found.size() < shares.size() && double(passed) >= shares[found.size()] * double(all)) {
      found.push_back(histogram.middle(part));
    }
  }
  return all > 0 ? found : std::vector<double>();
}

constexpr std::array<double, 5> kShares{0.05, 0.5, 0.8, 0.95, 0.995};
constexpr std::array<double, 5> kOpacities{0.004, 0.02, 0.08, 0.3, 0.7};

TransferFunction presetGray(const Volume& volume) {
  const Range range = rangeOf(volume);
  return overRange(range, {{range.low, {0, 0, 0}, 0.0}, {range.high, {1, 1, 1}, 0.3}});
}

/// Where Hounsfield units lie among a volume's values: they are values, or values less 1024, or the volume has been
/// squeezed into fewer numbers and they are spread over its range.
double hounsfield(Range range, double units) {
  if (range.low < -200.0) return units;
  if (range.high > 1000.0) return units + 1024.0;
  return range.at((units + 1024.0) / 4096.0);
}

TransferFunction presetCt(const Volume& volume, std::vector<TransferPoint> inUnits) {
  const Range range = rangeOf(volume);
  for (TransferPoint& point : inUnits)
    point.value = hounsfield(range, point.value);
  return overRange(range, std::move(inUnits));
}

TransferFunction presetCtBone(const Volume& volume) {
  return presetCt(volume, {{120, {0.65, 0.3, 0.2}, 0.0},
                           {220, {0.85, 0.65, 0.45}, 0.15},
                           {450, {0.97, 0.92, 0.8}, 0.7},
                           {1300, {1.0, 0.99, 0.95}, 0.95}});
}

TransferFunction presetCtSkin(const Volume& volume) {
  return presetCt(volume, {{-600, {0.8, 0.55, 0.42}, 0.0},
                           {-350, {0.87, 0.62, 0.48}, 0.35},
                           {-100, {0.9, 0.66, 0.52}, 0.5},
                           {150, {0.8, 0.4, 0.32}, 0.5},
                           {350, {1.0, 0.95, 0.88}, 0.9}});
}

TransferFunction presetMri(const Volume& volume) {
  const Range range = rangeOf(volume);
  const Histogram histogram = histogramOf(volume, 1024);
  const std::vector<double> r =
      reaches(histogram, range.low, 0.06 * (range.high - range.low), true, std::array{0.02, 0.3, 0.7, 0.97});
  if (r.size() < 4) return presetGray(volume);
  return overRange(range, {{range.low, {0.2, 0.08, 0.05}, 0.0},
                           {r[0], {0.35, 0.18, 0.12}, 0.0},
                           {r[1], {0.7, 0.45, 0.36}, 0.05},
                           {r[2], {0.9, 0.8, 0.7}, 0.15},
                           {r[3], {1.0, 0.98, 0.94}, 0.4}});
}

TransferFunction presetAngio(const Volume& volume) {
  const Range range = rangeOf(volume);
  return overRange(range, {{range.at(0.2), {0.5, 0.05, 0.03}, 0.0},
                           {range.at(0.35), {0.85, 0.12, 0.08}, 0.15},
                           {range.at(0.6), {1.0, 0.45, 0.3}, 0.6},
                           {range.at(1.0), {1.0, 0.92, 0.8}, 0.9}});
}

TransferFunction presetSigned(const Volume& volume) {
  const Range range = rangeOf(volume);
  const double reach = std::max(std::abs(range.low), std::abs(range.high));
  return overRange({-reach, reach}, {{-reach, {0.1, 0.3, 1.0}, 0.8},
                                     {-0.3 * reach, {0.35, 0.65, 1.0}, 0.08},
                                     {-0.12 * reach, {0.8, 0.9, 1.0}, 0.0},
                                     {0.12 * reach, {1.0, 0.9, 0.8}, 0.0},
                                     {0.3 * reach, {1.0, 0.6, 0.3}, 0.08},
                                     {reach, {1.0, 0.15, 0.1}, 0.8}});
}

TransferFunction presetSmoke(const Volume& volume) {
  const Range range = rangeOf(volume);
  return overRange(range, {{range.at(0.0), {0.55, 0.55, 0.58}, 0.0},
                           {range.at(0.1), {0.7, 0.7, 0.73}, 0.05},
                           {range.at(0.5), {0.9, 0.9, 0.92}, 0.2},
                           {range.at(1.0), {1.0, 1.0, 1.0}, 0.4}});
}

TransferFunction presetLevelSet(const Volume& volume) {
  const Range range = rangeOf(volume);
  // A little on either side of 0, in the units of the distance that the file holds.
  const double edge = 0.1 * std::min(std::abs(range.low), std::abs(range.high)) + 1e-3 * (range.high - range.low);
  return overRange(range, {{-edge, {0.95, 0.7, 0.4}, 0.95}, {edge, {0.95, 0.7, 0.4}, 0.0}});
}

/// Hues a golden angle apart never come close again soon.
glm::dvec3 labelColour(int64_t label) {
  const double hue = std::fmod(double(label) * 0.618033988749895, 1.0) * 6.0;
  const double chroma = label % 3 == 0 ? 0.55 : 0.75;
  const double value = label % 2 == 0 ? 0.95 : 0.85;
  const auto channel = [&](double shift) {
    const double h = std::fmod(hue + shift, 6.0);
    return value * (1.0 - chroma * std::clamp(std::min(h, 4.0 - h), 0.0, 1.0));
  };
  return {channel(5.0), channel(3.0), channel(1.0)};
}

constexpr double kMostLabels = 65533.0;  // two codes are kept for what lies outside

}  // namespace

const std::vector<TransferPreset>& transferPresets() {
  static const std::vector<TransferPreset> presets{
      {"auto", "from the histogram", automaticTransfer},
      {"gray", "from black and clear to white", presetGray},
      {"ct-bone", "bone in CT", presetCtBone},
      {"ct-skin", "skin over bone in CT", presetCtSkin},
      {"mri", "tissue in MRI", presetMri},
      {"angio", "vessels filled with contrast", presetAngio},
      {"signed", "blue below 0, red above", presetSigned},
      {"smoke", "white smoke", presetSmoke},
      {"level-set", "a surface where distances change sign", presetLevelSet},
      {"labels", "a colour for each whole number but 0", labelTransfer},
  };
  return presets;
}

TransferFunction automaticTransfer(const Volume& volume) {
  if (volume.header.labels) return labelTransfer(volume);
  const Range range = rangeOf(volume);
  const Histogram histogram = histogramOf(volume, 1024);
  const std::vector<double> surface = surfaceValues(volume);
  const double background = surface.empty() ? range.low : quantile(surface, 0.5);
  // What nearly all of the surface's values stay within, but no more than a sixth of the range.
  const double spread = std::max(quantile(surface, 0.98) - background, background - quantile(surface, 0.02));
  const double noise = std::clamp(spread, 0.02 * (range.high - range.low), (range.high - range.low) / 6.0);
  const std::array<glm::dvec3, 5> warm{
      glm::dvec3(0.45, 0.16, 0.1), {0.75, 0.35, 0.2}, {0.92, 0.62, 0.38}, {1.0, 0.88, 0.68}, {1.0, 0.98, 0.94}};
  const std::array<glm::dvec3, 5> cold{
      glm::dvec3(0.1, 0.2, 0.5), {0.18, 0.4, 0.75}, {0.35, 0.62, 0.92}, {0.6, 0.85, 1.0}, {0.9, 0.98, 1.0}};
  std::vector<TransferPoint> points{{background, warm[0], 0.0}};
  for (const bool above : {true, false}) {
    const std::vector<double> r = reaches(histogram, background, noise, above, kShares);
    if (r.empty()) continue;
    const auto& colours = above ? warm : cold;
    points.push_back({background + (above ? noise : -noise), colours[0], 0.0});
    for (size_t i = 0; i < r.size(); ++i) {
      // Shares may reach the same value: the rarest counts.
      if (points.back().value == r[i]) points.pop_back();
      points.push_back({r[i], colours[i], kOpacities[i]});
    }
  }
  return overRange(range, std::move(points));
}

TransferFunction labelTransfer(const Volume& volume) {
  if (isFloatingPoint(volume.header.type)) {
    throw InputError(fmt::format("labels are whole numbers, but the volume's values are of type {}",
                                 valueTypeName(volume.header.type)));
  }
  const ValueStatistics figures = valueStatistics(volume);
  if (figures.high - figures.low > kMostLabels) {
    throw InputError(fmt::format("labels from {} to {} are more than {}", figures.low, figures.high, kMostLabels));
  }
  const Histogram histogram = histogramOf(volume, size_t(kMostLabels) + 2);
  TransferFunction transfer;
  transfer.isLabels = true;
  for (size_t part = 0; part < histogram.counts.size(); ++part) {
    const auto label = int64_t(figures.low) + int64_t(part);
    if (histogram.counts[part] == 0 || label == 0) continue;
    transfer.points.push_back({double(label), labelColour(label), 0.6});
  }
  if (transfer.points.empty()) transfer.points.push_back({1.0, labelColour(1), 0.6});
  transfer.low = transfer.points.front().value - 1.0;
  transfer.high = transfer.points.back().value + 1.0;
  return transfer;
}

TransferFunction asLabels(const TransferFunction& transfer, const std::string& name) {
  if (transfer.isLabels) return transfer;
  const double first = std::ceil(transfer.low), last = std::floor(transfer.high);
  if (last - first > kMostLabels || last < first) {
    throw InputError(fmt::format("{}: expected a range of 1 to {} whole numbers for labels, found [{}, {}]", name,
                                 kMostLabels + 1, transfer.low, transfer.high));
  }
  TransferFunction labels;
  labels.isLabels = true;
  labels.low = first - 1.0;
  labels.high = last + 1.0;
  labels.referenceLength = transfer.referenceLength;
  for (double label = first; label <= last; label += 1.0)
    labels.points.push_back({label, transfer.srgbAt(label), transfer.opacityAt(label)});
  return labels;
}

namespace {

bool isTableWithoutValues(const std::string& path) {
  return lowerCase(std::filesystem::path(path).extension().string()) == ".1dt";
}

void refuseUnlessFile(const std::string& nameOrPath) {
  std::error_code ignored;
  if (nameOrPath.find_first_of("./") != std::string::npos || std::filesystem::exists(nameOrPath, ignored)) return;
  std::string names;
  for (const TransferPreset& preset : transferPresets())
    names += (names.empty() ? "" : ", ") + preset.name;
  throw InputError(fmt::format("{}: is neither a file nor one of {}", nameOrPath, names));
}

}  // namespace

TransferFunction chooseTransfer(const std::string& nameOrPath, const Volume& volume) {
  for (const TransferPreset& preset : transferPresets()) {
    if (preset.name != nameOrPath) continue;
    const TransferFunction transfer = preset.make(volume);
    return volume.header.labels ? asLabels(transfer, preset.name) : transfer;
  }
  refuseUnlessFile(nameOrPath);
  TransferFunction transfer = readTransferFunction(nameOrPath);
  if (isTableWithoutValues(nameOrPath)) {
    const Range range = rangeOf(volume);
    const bool fits = !isFloatingPoint(volume.header.type) && range.low >= 0.0 && range.high <= transfer.high;
    for (TransferPoint& point : transfer.points)
      if (!fits) point.value = range.at(point.value / transfer.high);
    if (!fits) {
      transfer.low = range.low;
      transfer.high = range.high;
    }
  }
  return volume.header.labels ? asLabels(transfer, nameOrPath) : transfer;
}

TransferFunction chooseTransfer(const std::string& nameOrPath, const VolumeHeader& header) {
  const auto& presets = transferPresets();
  const bool preset = std::any_of(presets.begin(), presets.end(), [&](const auto& p) { return p.name == nameOrPath; });
  if (!preset) refuseUnlessFile(nameOrPath);
  if (preset || isTableWithoutValues(nameOrPath)) {
    throw InputError(
        fmt::format("{}: a transfer function made from the volume's values needs them all in memory; make a file of it "
                    "with `freevoxel transfer`, or run one process without --memory",
                    nameOrPath));
  }
  const TransferFunction transfer = readTransferFunction(nameOrPath);
  return header.labels ? asLabels(transfer, nameOrPath) : transfer;
}

}  // namespace freevoxel
