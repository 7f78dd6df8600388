// Smooth random fields: cubic B-splines over lattices of hashed numbers. Integers, + - * only: the same everywhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace freevoxel {

/// A number in -1..1 for four integers; a hash with full avalanche.
double hashedNumber(uint64_t seed, uint64_t x, uint64_t y, uint64_t z);

/// One octave of noise over the unit box: `cells` lattice cells along every axis.
class NoiseOctave {
 public:
  NoiseOctave(uint64_t seed, int cells);

  /// Adds amplitude * noise at (position of voxel x of `count`, y, z) to sums[x] for all x; positions are fractions of
  /// the box in 0..1, voxel x has its centre at (x + 0.5) / count.
  void addRow(double y, double z, double amplitude, std::vector<double>& sums) const;

 private:
  double corner(int x, int y, int z) const {
    const auto edge = size_t(cells_) + 3;
    return corners_[(size_t(z) * edge + size_t(y)) * edge + size_t(x)];
  }

  int cells_;
  std::vector<double> corners_;  ///< (cells + 3)^3, x fastest; corner 0 lies one cell outside the box
};

}  // namespace freevoxel
