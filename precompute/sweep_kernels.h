// The inner loops of a sweep, for every instruction set: state in, bytes in brick planes out. They work on a strip: the
// voxels of one row of bricks, all x and one brick edge of y, of one z plane.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "precompute/fixed_depth.h"
#include "precompute/run_order.h"

namespace freevoxel {

/// Depths are kept up to here. Everything from 9 log2 on has A8 = 0, so bytes are those of saturation at 2^32 - 1; and
/// no sum of two, nor of 16 segments and one of them, leaves 32 bits.
inline constexpr FixedDepth kLargestKeptDepth = 0x0fffffff;

/// Rows of depths are this long or a multiple of it, and have as much room before and behind them.
inline constexpr int kRowUnit = 16;

/// One plane of a strip: state of voxel (x, y) becomes state of its neighbour (x + stepX, y + stepY), one step further
/// out, plus the segment to it.
struct StripUpdate {
  FixedDepth* state = nullptr;  ///< row 0 of the strip; of the plane before, or of this one where stepZ is 0
  size_t stride = 0;            ///< from row to row
  int rows = 0;                 ///< rows inside the volume
  int width = 0;                ///< voxels of a row, rounded up to kRowUnit
  int voxels = 0;               ///< of a row, inside the volume
  int stepX = 0, stepY = 0;
  bool samePlane = false;                ///< stepZ is 0
  const FixedDepth* upstream = nullptr;  ///< the neighbours' row beyond the strip; null: outside the volume
  const FixedDepth* segments = nullptr;  ///< segments[y * segmentStride + x]; 0 where the neighbour is outside
  size_t segmentStride = 0;
};

/// Entry -1 and entry `width` of every row must be 0 and stay so; so do those from `voxels` on.
void updateStrip(const StripUpdate& update);

/// Voxels first..last-1 of the rows of a strip.
struct StripPart {
  int first = 0, last = 0;  ///< multiples of kRowUnit
};

/// Bytes of one plane: words[(y / 4) * width + x] holds attenuationCode of four successive rows, the lowest y in the
/// lowest byte. `rows` is a multiple of 4.
void codeStrip(const FixedDepth* state, size_t stride, int rows, int width, std::span<const StripPart> parts,
               uint32_t* words);

/// Writes the runs of one brick that share z, permuted, past the caches. `words`: the brick's first word in the first
/// of four planes, as codeStrip makes them, planeWords apart; `runs`: runsPerEdge^2 of them, x fastest; `plane`: edge^3
/// bytes along the curve, 64-byte aligned.
void storeRuns(const uint32_t* words, size_t planeWords, int width, const BrickRun* runs, int runsPerEdge,
               uint8_t* plane);

/// Makes what storeRuns wrote visible to other threads that are told of it.
void finishStores();

}  // namespace freevoxel
