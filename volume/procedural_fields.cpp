// Procedural volumes made of random fields.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <numbers>

#include "volume/noise.h"
#include "volume/procedural_kinds.h"

namespace freevoxel {

namespace {

double eighthPower(double x) {
  const double square = x * x;
  return square * square * square * square;
}

/// Density 0..1: fractal noise that has to rise above a bowl, steep at the sides of the box, where nothing is.
class Cloud {
 public:
  Cloud(glm::ivec3 dims, uint64_t seed) : dims_(dims) {
    for (int octave = 0; octave < kOctaves; ++octave)
      octaves_.emplace_back(seed + uint64_t(octave), kCells << octave);
  }

  /// Densities along a row of voxels.
  std::vector<double> row(int y, int z) const {
    const double fy = (y + 0.5) / dims_.y;
    const double fz = (z + 0.5) / dims_.z;
    std::vector<double> densities(size_t(dims_.x), 0.0);
    double amplitude = 1.0;
    for (const NoiseOctave& octave : octaves_) {
      octave.addRow(fy, fz, amplitude, densities);
      amplitude *= kFalloff;
    }
    for (int x = 0; x < dims_.x; ++x) {
      const double dx = 2.0 * (x + 0.5) / dims_.x - 1.0;
      const double dy = 2.0 * fy - 1.0;
      const double dz = 2.0 * fz - 1.0;
      const double bowl = kBowl * (dx * dx + dy * dy + dz * dz) + eighthPower(dx) + eighthPower(dy) + eighthPower(dz);
      const double raised = kGain * densities[size_t(x)] + kLevel - bowl;
      densities[size_t(x)] = std::clamp(raised, 0.0, 1.0);
    }
    return densities;
  }

 private:
  static constexpr int kOctaves = 5;
  static constexpr int kCells = 4;  ///< of the coarsest octave
  static constexpr double kFalloff = 0.55;
  static constexpr double kGain = 1.3;
  static constexpr double kLevel = 0.5;
  static constexpr double kBowl = 1.0;

  glm::ivec3 dims_;
  std::vector<NoiseOctave> octaves_;
};

/// The generator of bytes `value(density, voxel)` over a cloud.
template <class F>
SliceGenerator cloudBytes(glm::ivec3 dims, uint64_t seed, F value) {
  // std::function copies what it holds; the lattices need not be.
  const auto cloud = std::make_shared<const Cloud>(dims, seed);
  return [cloud, dims, value](int z, std::byte* out) {
    for (int y = 0; y < dims.y; ++y) {
      const std::vector<double> densities = cloud->row(y, z);
      for (int x = 0; x < dims.x; ++x)
        *out++ = std::byte(value(densities[size_t(x)], glm::ivec3(x, y, z)));
    }
  };
}

/// A sum of `kRank` products of one wave along each axis (voxlink section 6.2: low-rank Kronecker volumes from
/// geostatistics). Products of cosines have little more in their tails than a normal distribution, so few ranks do.
class Kronecker {
 public:
  static constexpr int kRank = 48;
  using Products = std::array<double, kRank>;  ///< of the waves along y and z, for each rank

  Kronecker(glm::ivec3 dims, uint64_t seed) : dims_(dims) {
    for (int axis = 0; axis < 3; ++axis) {
      waves_[size_t(axis)].resize(size_t(dims[axis]) * kRank);
      for (int rank = 0; rank < kRank; ++rank) {
        const auto random = [&](int what) {
          return 0.5 + 0.5 * hashedNumber(seed, uint64_t(rank), uint64_t(axis), uint64_t(what));
        };
        const double cycles = kLowestCycles + (kHighestCycles - kLowestCycles) * random(0);
        const double phase = random(1);
        for (int i = 0; i < dims[axis]; ++i) {
          waves_[size_t(axis)][size_t(i) * kRank + size_t(rank)] =
              std::cos(2.0 * std::numbers::pi * (cycles * (i + 0.5) / dims[axis] + phase));
        }
      }
    }
    standardise();
  }

  float value(const Products& products, int x) const {
    double sum = -mean_;
    for (size_t rank = 0; rank < kRank; ++rank)
      sum += products[rank] * waves_[0][size_t(x) * kRank + rank];
    return float(sum * scale_);
  }

  Products rowProducts(int y, int z) const {
    Products products{};
    for (size_t rank = 0; rank < kRank; ++rank) {
      products[rank] = waves_[1][size_t(y) * kRank + rank] * waves_[2][size_t(z) * kRank + rank];
    }
    return products;
  }

 private:
  static constexpr double kLowestCycles = 1.5;
  static constexpr double kHighestCycles = 7.0;

  /// Mean and deviation over all voxels, exactly, from sums along the axes alone.
  void standardise() {
    double square = 0.0;
    mean_ = 0.0;
    for (size_t a = 0; a < kRank; ++a) {
      double mean = 1.0;
      for (size_t axis = 0; axis < 3; ++axis)
        mean *= axisMean(axis, a, a, false);
      mean_ += mean;
      for (size_t b = 0; b < kRank; ++b) {
        double product = 1.0;
        for (size_t axis = 0; axis < 3; ++axis)
          product *= axisMean(axis, a, b, true);
        square += product;
      }
    }
    const double variance = square - mean_ * mean_;
    scale_ = variance > 1e-12 ? 1.0 / std::sqrt(variance) : 1.0;  // a single voxel varies not at all
  }

  double axisMean(size_t axis, size_t a, size_t b, bool product) const {
    const int count = dims_[int(axis)];
    double sum = 0.0;
    for (size_t i = 0; i < size_t(count); ++i) {
      sum += waves_[axis][i * kRank + a] * (product ? waves_[axis][i * kRank + b] : 1.0);
    }
    return sum / count;
  }

  glm::ivec3 dims_;
  std::array<std::vector<double>, 3> waves_;  ///< [axis][voxel * kRank + rank]
  double mean_ = 0.0;
  double scale_ = 1.0;
};

}  // namespace

SliceGenerator cloudGenerator(glm::ivec3 dims, uint64_t seed) {
  return cloudBytes(dims, seed, [](double density, glm::ivec3) { return uint8_t(255.0 * density + 0.5); });
}

SliceGenerator checkeredCloudGenerator(glm::ivec3 dims, uint64_t seed) {
  constexpr int kCells = 6;
  // Nothing is in the middle of the scale: between cells, and at the edge of the cloud, interpolation passes through
  // nothing and not through the other colour.
  return cloudBytes(dims, seed, [dims](double density, glm::ivec3 voxel) {
    int parity = 0;
    for (int axis = 0; axis < 3; ++axis)
      parity += int(int64_t(voxel[axis]) * kCells / dims[axis]);
    const int amount = int(127.0 * density + 0.5);
    return uint8_t(parity % 2 == 0 ? 128 + amount : 128 - amount);
  });
}

SliceGenerator kroneckerGenerator(glm::ivec3 dims, uint64_t seed) {
  const auto field = std::make_shared<const Kronecker>(dims, seed);
  return [field, dims](int z, std::byte* out) {
    for (int y = 0; y < dims.y; ++y) {
      const auto products = field->rowProducts(y, z);
      for (int x = 0; x < dims.x; ++x, out += sizeof(float)) {
        const float value = field->value(products, x);
        std::memcpy(out, &value, sizeof(float));
      }
    }
  };
}

}  // namespace freevoxel
