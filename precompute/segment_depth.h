// Optical depth between neighbouring voxels.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "precompute/fixed_depth.h"
#include "precompute/format.h"
#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// What light loses between a voxel and its neighbour towards the outside. Each segment counts as one edge long
/// whatever its direction: the length is restored where A is looked up (A^l).
class SegmentDepth {
 public:
  virtual ~SegmentDepth() = default;
  /// depths[x] = segment(codes[x], nextCodes[x]); all three of one size. Const and safe to call from many threads.
  virtual void row(std::span<const uint16_t> codes, std::span<const uint16_t> nextCodes, FixedDepth* depths) const = 0;
  /// Whether `codes` make no difference, so that one look-up per voxel serves all directions.
  virtual bool isOfNeighbourOnly() const { return false; }
};

/// `voxel`: the neighbour's own depth, so that A8 is the product of T over the voxels strictly between (Eq. 5).
/// `preintegrated`: mean extinction along the straight line between the two values (Eq. 4 with values interpolated
/// before they are classified; K. Engel et al., Pre-integrated Volume Rendering, 2001). Symmetric in its arguments.
std::unique_ptr<SegmentDepth> makeSegmentDepth(Classification classification, const TransferFunction& transfer,
                                               const ValueCoding& coding);

}  // namespace freevoxel
