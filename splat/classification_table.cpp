#include "splat/classification_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "shaders/shared/cell_segment.h"

namespace freevoxel {

namespace {

/// Enough for a step of the transfer function to fall between two entries that are far closer than values can be told
/// apart in a picture, and few enough to stay in the second-level cache.
constexpr uint32_t kWantedEntries = 8192;
/// Points in an interval at which the transfer function is sampled.
constexpr int kSamples = 4;

}  // namespace

ClassificationTable classificationTable(const TransferFunction& transfer, const ValueCoding& coding) {
  const uint32_t perCode = std::max(1u, std::min(32u, kWantedEntries / coding.largest));
  const size_t intervals = size_t(coding.largest) * perCode;
  ClassificationTable table;
  table.entriesPerCode = float(perCode);
  table.integral.resize(intervals + 1);
  table.density.resize(intervals + 1);
  double sums[4] = {};
  for (size_t i = 0; i < intervals; ++i) {
    double mean[4] = {};
    for (int sample = 0; sample < kSamples; ++sample) {
      const double code = (double(i) + (sample + 0.5) / kSamples) / perCode;
      const Classified at = transfer.at(coding.decode(code));
      const double extinction = double(at.extinction) / std::numbers::ln2;
      for (int channel = 0; channel < 3; ++channel)
        mean[channel] += double(at.linear[channel]) * extinction / kSamples;
      mean[3] += extinction / kSamples;
    }
    table.integral[i] = {float(sums[0]), float(sums[1]), float(sums[2]), float(sums[3])};
    table.density[i] = {float(mean[0]), float(mean[1]), float(mean[2]), float(mean[3])};
    for (int channel = 0; channel < 4; ++channel)
      sums[channel] += mean[channel];
  }
  table.integral[intervals] = {float(sums[0]), float(sums[1]), float(sums[2]), float(sums[3])};
  table.density[intervals] = table.density[intervals - 1];
  return table;
}

float ClassificationTable::meanExtinction(float from, float to) const {
  const auto at = [this](float place) {
    const size_t entry = size_t(place);
    return integral[entry].extinction + (place - float(entry)) * density[entry].extinction;
  };
  if (std::abs(to - from) < shared::kNearlyEqual) return density[size_t(0.5f * (from + to))].extinction;
  return std::max(0.0f, (at(to) - at(from)) / (to - from));
}

}  // namespace freevoxel
