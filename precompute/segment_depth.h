// Optical depth between neighbouring voxels.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "precompute/code_table.h"
#include "precompute/fixed_depth.h"
#include "precompute/format.h"
#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// How the segment between two voxels follows from what each contributes, SegmentTerms.
enum class SegmentRule {
  /// The neighbour's own depth.
  neighbour,
  /// (high' - high) / (code' - code) rounded to the nearest, for equal codes own; all in float.
  integral,
  /// (high' - high + (low' - low)) / (code' - code) likewise.
  splitIntegral,
};

/// What voxels contribute to the segments that they are ends of, one entry a voxel.
template <class Depth, class Float>
struct SegmentTermRows {
  Depth* own = nullptr;
  // Of the integral rules only; low of splitIntegral.
  Float* code = nullptr;
  Float* high = nullptr;
  Float* low = nullptr;
};
using SegmentTerms = SegmentTermRows<const FixedDepth, const float>;
using MutableSegmentTerms = SegmentTermRows<FixedDepth, float>;

/// What light loses between a voxel and its neighbour towards the outside. Each segment counts as one edge long
/// whatever its direction: the length is restored where A is looked up (A^l). Const and safe to call from many threads.
class SegmentDepth {
 public:
  virtual ~SegmentDepth() = default;
  virtual SegmentRule rule() const = 0;
  /// Fills as many rows, `stride` apart, of what the rule asks for and is not null.
  virtual void terms(const CodeRows& codes, const MutableSegmentTerms& rows, size_t stride) const = 0;
  /// depths[x] = segment(codes[x], nextCodes[x]); all three of one size.
  virtual void row(std::span<const uint16_t> codes, std::span<const uint16_t> nextCodes, FixedDepth* depths) const = 0;
};

/// `voxel`: the neighbour's own depth, so that A8 is the product of T over the voxels strictly between (Eq. 5).
/// `preintegrated`: mean extinction along the straight line between the two values (Eq. 4 with values interpolated
/// before they are classified; K. Engel et al., Pre-integrated Volume Rendering, 2001). Symmetric in its arguments. Off
/// by rounding to 2^-24 of itself and, for codes of one byte, by up to 2^-17 of the mean extinction over all codes.
std::unique_ptr<SegmentDepth> makeSegmentDepth(Classification classification, const TransferFunction& transfer,
                                               const ValueCoding& coding);

}  // namespace freevoxel
