#include "volume/noise.h"

#include <algorithm>
#include <array>

namespace freevoxel {

namespace {

/// SplitMix64's finaliser.
uint64_t mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

/// A position on a lattice: the first of the four corners that count, and their weights.
struct Spline {
  int first;
  std::array<double, 4> weights;
};

Spline splineAt(double fraction, int cells) {
  const double position = fraction * cells;
  const int cell = std::clamp(int(position), 0, cells - 1);
  const double t = position - cell;
  const double s = 1.0 - t;
  return {
      cell,
      {s * s * s / 6.0, (4.0 + 3.0 * t * t * (t - 2.0)) / 6.0, (4.0 + 3.0 * s * s * (s - 2.0)) / 6.0, t * t * t / 6.0}};
}

}  // namespace

double hashedNumber(uint64_t seed, uint64_t x, uint64_t y, uint64_t z) {
  constexpr uint64_t kGolden = 0x9e3779b97f4a7c15u;
  const uint64_t bits = mix(mix(mix(mix(seed + kGolden) + x * kGolden) + y * kGolden) + z * kGolden);
  return double(bits >> 11) * 0x1p-52 - 1.0;
}

NoiseOctave::NoiseOctave(uint64_t seed, int cells) : cells_(cells) {
  const int edge = cells + 3;
  corners_.reserve(size_t(edge) * size_t(edge) * size_t(edge));
  for (int z = 0; z < edge; ++z) {
    for (int y = 0; y < edge; ++y) {
      for (int x = 0; x < edge; ++x)
        corners_.push_back(hashedNumber(seed, uint64_t(x), uint64_t(y), uint64_t(z)));
    }
  }
}

void NoiseOctave::addRow(double y, double z, double amplitude, std::vector<double>& sums) const {
  const Spline sy = splineAt(y, cells_);
  const Spline sz = splineAt(z, cells_);
  std::vector<double> row(size_t(cells_ + 3), 0.0);
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      const double weight = amplitude * sz.weights[size_t(k)] * sy.weights[size_t(j)];
      for (int x = 0; x < cells_ + 3; ++x)
        row[size_t(x)] += weight * corner(x, sy.first + j, sz.first + k);
    }
  }
  const auto count = double(sums.size());
  for (size_t x = 0; x < sums.size(); ++x) {
    const Spline sx = splineAt((double(x) + 0.5) / count, cells_);
    const double* corners = row.data() + sx.first;
    sums[x] += sx.weights[0] * corners[0] + sx.weights[1] * corners[1] + sx.weights[2] * corners[2] +
               sx.weights[3] * corners[3];
  }
}

}  // namespace freevoxel
