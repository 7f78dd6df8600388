// Values quantised over a range: what the attenuation file stores and every stage after it classifies.
#pragma once

#include <cstdint>
#include <vector>

#include "volume/volume.h"

namespace freevoxel {

/// Maps values to unsigned codes of 1 or 2 bytes: code = round((value - low) / step), clamped to 0..maxCode().
/// Values outside the range clamp to its ends, as a transfer function does. NaN and -infinity take code 0, +infinity
/// the largest code (callers count them, see ValueStatistics::nonFinite).
/// Invariant: step > 0, 1 <= largest <= 65535, low + largest * step is the range's high end.
struct ValueCoding {
  double low = 0.0;
  double step = 1.0;
  uint32_t largest = 255;

  int bytes() const { return largest > 255 ? 2 : 1; }
  uint32_t encode(double value) const;
  double decode(double code) const { return low + code * step; }
  /// Where a value lies on the scale of codes, not rounded and not clamped.
  double position(double value) const { return (value - low) / step; }
};

/// The coding for data of a type over a transfer function's range [low, high], low < high, both finite. Integer data is
/// coded without loss inside the range where the range, widened to whole numbers, has at most 65536 of them (1 byte up
/// to 256); all else takes 65536 equal steps.
ValueCoding valueCoding(ValueType type, double low, double high);

/// Codes of every voxel in the volume's order, one uint16_t each whatever coding.bytes() is.
std::vector<uint16_t> encodeValues(const Volume& volume, const ValueCoding& coding);

}  // namespace freevoxel
