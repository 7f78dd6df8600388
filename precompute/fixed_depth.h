// Optical depth in the fixed point that makes sums independent of their order, and the byte that a sum becomes.
#pragma once

#include <algorithm>
#include <bit>
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

/// 255 * 2^-f for a fraction f of 2^16 in 0..1, to 0.0016: interpolates at both ends and at three points between.
inline constexpr float kExp2Coefficients[5] = {255.0f, -176.74452209545953f * 0x1p-16f, 61.1046259652167f * 0x1p-32f,
                                               -13.606555986319323f * 0x1p-48f, 1.7464521165621538f * 0x1p-64f};
/// Depths from here on, in units of 2^-16 log2, are one: A8 is 0 from 9 log2 on.
inline constexpr int32_t kLargestCodedDepth = 0xfffff;

/// round(255 * 2^-depth) = A8: the nearest code unless 255 A lies within 0.0045 of the middle between two (the depth is
/// cut to 2^-16 log2, worth up to 0.0027, and the power is a polynomial). Exact + - * on floats and integers only, so
/// the same on every machine.
constexpr uint8_t attenuationCode(FixedDepth depth) {
  const int32_t coded = std::min(int32_t(depth >> 8), kLargestCodedDepth);
  const auto f = float(coded & 0xffff);
  const float(&c)[5] = kExp2Coefficients;
  const float power = c[0] + f * (c[1] + f * (c[2] + f * (c[3] + f * c[4])));
  // Divides by 2^(whole part) through the exponent; at least 127.5 * 2^-15 is left, a normal number.
  const float code = std::bit_cast<float>(std::bit_cast<int32_t>(power) - ((coded >> 16) << 23));
  return uint8_t(code + 0.5f);  // NOLINT(bugprone-incorrect-roundings): never negative
}

/// depths[i] = table[codes[i]].
void lookUpDepths(const FixedDepth* table, const uint16_t* codes, size_t count, FixedDepth* depths);

/// depths[i] = table[codes[i] * 256 + nextCodes[i]], both codes up to 255. Where both are below `firstVisible` the
/// table must hold 0: it is not looked into there.
void lookUpDepthPairs(const FixedDepth* table, const uint16_t* codes, const uint16_t* nextCodes, size_t count,
                      uint16_t firstVisible, FixedDepth* depths);

}  // namespace freevoxel
