#include "volume/transfer_function.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "base/error.h"
#include "base/image.h"

namespace freevoxel {

namespace {

/// The points a value lies between: from[0], to[0] and how far it is from the one to the other. Equal where the
/// function is constant.
struct Segment {
  const TransferPoint* from;
  const TransferPoint* to;
  double t;
};

double clampToRange(const TransferFunction& transfer, double value) {
  return value > transfer.low ? std::min(value, transfer.high) : transfer.low;  // NaN goes to the low end
}

/// The label of a value, or of a number that has none an invisible one.
const TransferPoint* labelAt(const TransferFunction& transfer, double value) {
  static constexpr TransferPoint kNone{};
  const double label = std::round(value);
  const auto found = std::lower_bound(transfer.points.begin(), transfer.points.end(), label,
                                      [](const TransferPoint& point, double v) { return point.value < v; });
  return found != transfer.points.end() && found->value == label ? &*found : &kNone;
}

Segment segmentAt(const TransferFunction& transfer, double value) {
  if (transfer.isLabels) {
    const TransferPoint* label = labelAt(transfer, value);
    return {label, label, 0.0};
  }
  const std::vector<TransferPoint>& points = transfer.points;
  const double clamped = clampToRange(transfer, value);
  // The last point at or below the value: of two with one value, the later.
  const auto above = std::upper_bound(points.begin(), points.end(), clamped,
                                      [](double v, const TransferPoint& point) { return v < point.value; });
  if (above == points.begin()) return {&points.front(), &points.front(), 0.0};
  const auto below = above - 1;
  if (above == points.end()) return {&*below, &*below, 0.0};
  return {&*below, &*above, (clamped - below->value) / (above->value - below->value)};
}

}  // namespace

glm::dvec3 TransferFunction::srgbAt(double value) const {
  const Segment s = segmentAt(*this, value);
  glm::dvec3 srgb;
  for (int channel = 0; channel < 3; ++channel)
    srgb[channel] = std::lerp(s.from->srgb[channel], s.to->srgb[channel], s.t);
  return srgb;
}

double TransferFunction::opacityAt(double value) const {
  const Segment s = segmentAt(*this, value);
  // std::lerp never leaves the interval between its ends, so corners bound what lies between them.
  return std::lerp(s.from->opacity, s.to->opacity, s.t);
}

double TransferFunction::extinctionAt(double value) const {
  return std::min(-std::log1p(-opacityAt(value)) / referenceLength, kLargestExtinction);
}

Classified TransferFunction::at(double value) const {
  const glm::dvec3 srgb = srgbAt(value);
  Classified classified;
  for (int channel = 0; channel < 3; ++channel)
    classified.linear[channel] = linearFromSrgb(float(srgb[channel]));
  classified.extinction = float(extinctionAt(value));
  return classified;
}

double TransferFunction::largestOpacity(double a, double b) const {
  const double first = clampToRange(*this, a);
  const double last = clampToRange(*this, b);
  double largest = std::max(opacityAt(first), opacityAt(last));
  if (isLabels) {
    for (const TransferPoint& point : points) {
      if (point.value >= std::round(first) && point.value <= std::round(last))
        largest = std::max(largest, point.opacity);
    }
    return largest;
  }
  // A corner above `first` counts even where a later one of the same value replaces it: values just below come as
  // close to its opacity as one likes.
  for (const TransferPoint& point : points) {
    if (point.value > first && point.value <= last) largest = std::max(largest, point.opacity);
  }
  return largest;
}

uint64_t opacityHash(const TransferFunction& transfer) {
  std::vector<double> figures{transfer.low, transfer.high, transfer.referenceLength};
  for (const TransferPoint& point : transfer.points) {
    figures.push_back(point.value);
    figures.push_back(point.opacity);
  }
  if (transfer.isLabels) figures.push_back(1.0);
  for (double& figure : figures)
    figure += 0.0;  // -0 and 0 are one number
  return XXH3_64bits(figures.data(), figures.size() * sizeof(double));
}

namespace {

/// Whether f(transfer, value) holds on both sides of every corner of either; in between all is linear.
template <class F>
bool atEveryCorner(const TransferFunction& a, const TransferFunction& b, F&& f) {
  std::vector<double> corners{a.low, a.high};
  for (const TransferFunction* transfer : {&a, &b}) {
    for (const TransferPoint& point : transfer->points)
      corners.push_back(point.value);
  }
  return std::all_of(corners.begin(), corners.end(), [&](double corner) {
    return f(corner) && f(std::nextafter(corner, -std::numeric_limits<double>::infinity()));
  });
}

constexpr double kSameWithin = 1e-12;

}  // namespace

bool sameOpacity(const TransferFunction& a, const TransferFunction& b) {
  if (a.low != b.low || a.high != b.high || a.referenceLength != b.referenceLength || a.isLabels != b.isLabels) {
    return false;
  }
  return atEveryCorner(a, b,
                       [&](double value) { return std::abs(a.opacityAt(value) - b.opacityAt(value)) <= kSameWithin; });
}

bool sameColours(const TransferFunction& a, const TransferFunction& b) {
  return atEveryCorner(a, b, [&](double value) {
    const glm::dvec3 difference = glm::abs(a.srgbAt(value) - b.srgbAt(value));
    return std::max({difference.x, difference.y, difference.z}) <= kSameWithin;
  });
}

std::vector<Classified> transferTable(const TransferFunction& transfer, size_t size) {
  check(size >= 2, "a transfer table has at least two entries");
  std::vector<Classified> table(size);
  for (size_t i = 0; i < size; ++i) {
    table[i] = transfer.at(std::lerp(transfer.low, transfer.high, double(i) / double(size - 1)));
  }
  return table;
}

}  // namespace freevoxel
