// Optical depth in the fixed point that makes sums independent of their order, and the byte that a sum becomes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace freevoxel {

/// Optical depth as -log2 of attenuation in units of 2^-24, saturating at 2^32 - 1, just under 256: far below what a
/// byte or a float picture can tell from 0. Saturating addition of unsigned numbers is associative and commutative.
using FixedDepth = uint32_t;
inline constexpr double kDepthUnitsPerLog2 = 16777216.0;

/// Fixed-point depth of one shortest voxel edge of extinction `sigma` (natural, per edge, 0..kLargestExtinction).
FixedDepth fixedDepth(double sigma);

/// Depth of `units`, 0 or more, rounded to the nearest.
constexpr FixedDepth roundedDepth(double units) {
  return FixedDepth(units + 0.5);  // NOLINT(bugprone-incorrect-roundings): never negative
}

constexpr FixedDepth saturatingSum(FixedDepth a, FixedDepth b) {
  return std::min(a, ~b) + b;
}

/// Depths from here on, in units of 2^-12 log2, are one: A8 is 0 from 9 log2 on.
inline constexpr int32_t kLargestCodedDepth = 0xffff;
/// 2^7 * 255 * 2^-f = c[0] - f (c[1] - f (c[2] - f c[3])) for a fraction f = 0..1, to 2.9: chosen for the smallest
/// error in the middles of 4096 intervals, products rounded to whole numbers.
inline constexpr int16_t kExp2Coefficients[4] = {32637, 22573, 7551, 1298};
inline constexpr int kExp2FractionBits = 7;

/// a * b / 2^15 rounded to the nearest, halves upwards: what processors call a rounding fixed-point product.
constexpr int32_t fixedProduct(int32_t a, int32_t b) {
  return (a * b + (1 << 14)) >> 15;
}

/// round(255 * 2^-depth) = A8: the nearest code unless 255 A lies within 0.038 of the middle between two (the depth is
/// cut to 2^-12 log2, worth up to 0.022 either way, and the power is a polynomial). Numbers of 16 bits only, so that
/// many fit a register, and the same on every machine.
constexpr uint8_t attenuationCode(FixedDepth depth) {
  const int32_t coded = std::min(int32_t(depth >> 12), kLargestCodedDepth);
  const int32_t f = (coded & 0xfff) << 3;
  const int16_t(&c)[4] = kExp2Coefficients;
  const int32_t power = c[0] - fixedProduct(f, c[1] - fixedProduct(f, c[2] - fixedProduct(f, c[3])));
  return uint8_t(((power >> (coded >> 12)) + (1 << (kExp2FractionBits - 1))) >> kExp2FractionBits);
}

}  // namespace freevoxel
