// The inner loops of a sweep, for every instruction set: state in, bytes in brick planes out. They work on a tile: four
// rows of four planes, as wide as the volume, so that what several directions read of it stays in the nearest caches,
// and what comes out are whole runs of the curve.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "precompute/fixed_depth.h"
#include "precompute/run_order.h"
#include "precompute/segment_depth.h"

namespace freevoxel {

/// What is passed on is cut to this at the end of a tile, along a row in every vector. Everything from 9 log2 on has
/// A8 = 0, so bytes are those of saturation at 2^32 - 1; and this and 16 segments do not leave 32 bits.
inline constexpr FixedDepth kLargestKeptDepth = 0x0fffffff;

/// Rows are this long or a multiple of it, and have as much room before and behind them.
inline constexpr int kRowUnit = 16;

/// What changes from plane to plane of a tile.
struct TilePlane {
  uint32_t own = 0, neighbour = 0;     ///< entries of Tile::terms at which the voxels' and the neighbours' planes start
  bool neighbourOutside = false;       ///< the neighbours' plane lies outside the volume
  const FixedDepth* beyond = nullptr;  ///< what Tile::beyondRow's neighbours pass on
  FixedDepth* leaving = nullptr;       ///< where to put what Tile::leavingRow passes on, or null
  uint8_t* bytes = nullptr;            ///< A8: byte x % 4 + 4 * row of the 16 at 4 * (x - x % 4)
};

/// Four rows of voxels along one direction. A voxel passes on what its neighbours further in see: its depth, with the
/// rule `neighbour` and its own. State is what the plane before passes on. All rows have room of zeros before and
/// behind them; neighbours' rows are given less the step along x.
struct Tile {
  SegmentRule rule = SegmentRule::neighbour;
  SegmentTerms terms;
  /// From the start of a plane to the rows of the voxels: outside the volume to a row of zeros.
  std::array<uint32_t, kRunEdge> own{};
  /// Whether the rows and their neighbours' lie in the volume.
  std::array<bool, kRunEdge> linked{};
  /// The rows at both ends of segments: if not linked, both a row of zeros.
  std::array<uint32_t, kRunEdge> from{}, neighbour{};
  /// What the neighbours pass on, of directions that leave the plane: rows of the state; zeros if not linked.
  std::array<const FixedDepth*, kRunEdge> next{};
  int beyondRow = -1;            ///< the row that takes TilePlane::beyond in place of `next`, or none
  int leavingRow = 0;            ///< the row that neighbours of other tiles will need
  FixedDepth* state = nullptr;   ///< row 0; not used by directions that stay in their plane
  FixedDepth* depths = nullptr;  ///< room for four rows of depths, if these are wanted
  size_t stride = 0;             ///< from row to row of both
  int width = 0;                 ///< voxels of a row, rounded up to kRowUnit
  int voxels = 0;                ///< of a row, inside the volume
  int stepX = 0, stepY = 0;
  bool samePlane = false;           ///< the direction stays in its plane
  const uint8_t* wanted = nullptr;  ///< for each kRowUnit voxels: whether their bytes are needed
  std::array<TilePlane, kRunEdge> planes{};
  int planeCount = 0;
};

/// Renews the state plane by plane and gives the bytes of every plane, and the depths of the last one. Room before and
/// behind the rows must be 0 and stays so.
void sweepTile(const Tile& tile);

/// Where the runs of a brick go.
struct BrickRow {
  int x = 0;                       ///< first voxel, a multiple of the brick's edge
  const BrickRun* runs = nullptr;  ///< of the whole brick
  uint8_t* planes = nullptr;       ///< edge^3 bytes each along the curve, 64-byte aligned
};

/// Permutes the bytes of a tile, planeBytes apart, and writes them past the caches: of every brick the runs
/// firstRun .. firstRun + runsPerEdge - 1, in the plane that starts planeOffset bytes behind the first.
void storeRuns(const uint8_t* bytes, size_t planeBytes, std::span<const BrickRow> bricks, size_t firstRun,
               int runsPerEdge, size_t planeOffset);

/// Makes what storeRuns wrote visible to other threads that are told of it.
void finishStores();

}  // namespace freevoxel
