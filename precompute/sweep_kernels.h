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

/// What is passed on is cut to this at the end of a tile at the latest, along a row in every vector. Everything from 9
/// log2 on has A8 = 0, so bytes are those of saturation at 2^32 - 1; and this and 16 segments do not leave 32 bits.
inline constexpr FixedDepth kLargestKeptDepth = 0x0fffffff;

/// Rows are this long or a multiple of it, and have as much room before and behind them.
inline constexpr int kRowUnit = 16;

/// What changes from plane to plane of a tile.
struct TilePlane {
  ptrdiff_t own = 0, neighbour = 0;    ///< entries of Tile::terms of the first voxel and of its neighbour
  bool neighbourOutside = false;       ///< the neighbours' plane lies outside the volume
  const FixedDepth* beyond = nullptr;  ///< what the neighbours in the tile before pass on, if stepY is not 0
  FixedDepth* leaving = nullptr;       ///< where to put what the next tile's neighbours pass on, likewise
  uint8_t* bytes = nullptr;            ///< A8: byte x % 4 + 4 * row of the 16 at 4 * (x - x % 4)
};

/// Four rows of voxels along one direction. A voxel passes on what its neighbours further in see: its depth, with the
/// rule `neighbour` and its own. State is what the plane before passes on. All rows have room before and behind them.
/// That of state, of what comes from beyond and, in a fan, of depths holds zeros. That of terms is outside the volume,
/// where own, high and low are 0 and codes are infinite: a segment with one end there is 0.
struct Tile {
  SegmentRule rule = SegmentRule::neighbour;
  SegmentTerms terms;
  FixedDepth* state = nullptr;  ///< row 0; not used by directions that stay in their plane
  /// Four rows for depths. With the rule `neighbour` what stays in its row writes to the room beside them too.
  FixedDepth* depths = nullptr;
  bool depthsWanted = false;  ///< they are to be there afterwards
  size_t stride = 0;          ///< from row to row of terms, state and depths
  int width = 0;              ///< voxels of a row, rounded up to kRowUnit
  int stepX = 0, stepY = 0;
  bool samePlane = false;           ///< the direction stays in its plane
  const uint8_t* wanted = nullptr;  ///< for each kRowUnit voxels: whether their bytes are needed
  std::array<TilePlane, kRunEdge> planes{};
  int planeCount = 0;
};

/// Renews the state plane by plane and gives the bytes of every plane, and the depths of the last one. For voxels
/// outside the volume all of these are those of depth 0 or, where the sweep gets there from inside, anybody's guess.
void sweepTile(const Tile& tile);

/// Directions that differ in their steps along x only: -1, 0 and 1.
inline constexpr int kFanDirections = 3;
using Fan = std::array<const Tile*, kFanDirections>;

/// The same for three tiles at once, with one of the integral rules: what they read of the voxels they read together.
/// Depths are not asked for; there must be room for them if the directions stay in their planes.
void sweepFan(const Fan& fan);

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
