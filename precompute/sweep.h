// Attenuation of every voxel along the 26 lattice directions (papers/freevoxels section 3.1), plane by plane, into
// brick planes in curve order: a voxel's depth is its neighbour's, one step further out, plus the segment between them.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "precompute/level_tap.h"
#include "precompute/segment_depth.h"
#include "precompute/sweep_memory.h"
#include "shaders/shared/directions.h"

namespace freevoxel {

/// The 26 directions are swept in two passes of 13, upwards through the planes for directions 0..12 and downwards for
/// 13..25: opposite directions, and so the two halves of a file, never share one.
inline constexpr int kSweepPasses = 2;
constexpr int sweepPass(int direction) {
  return direction / kDirectionsPerSection;
}

/// Addresses of brick planes are multiples of this.
inline constexpr size_t kBrickPlaneAlignment = 64;

/// Where the attenuation of one brick goes.
struct BrickPlanes {
  glm::ivec3 position{0};     ///< voxel / edge
  int hilbertState = 0;       ///< see hilbertState
  uint8_t* planes = nullptr;  ///< the pass's 13 planes of edge^3 bytes each, along the curve; 255 outside the volume
};

/// Gives the value codes of successive planes, of one pass: slab after slab, upwards for pass 0, downwards for pass 1.
class CodePlanes {
 public:
  virtual ~CodePlanes() = default;
  /// Codes of planes first..first+count-1, x fastest, until the next call for the same pass. Called from one thread.
  virtual std::span<const uint16_t> planes(int pass, int first, int count) = 0;
  /// No more planes are asked for by this pass.
  virtual void release(int /*pass*/) {}
};

/// All codes in memory.
class StoredCodePlanes final : public CodePlanes {
 public:
  StoredCodePlanes(std::span<const uint16_t> codes, glm::ivec3 dims);
  std::span<const uint16_t> planes(int pass, int first, int count) override;

 private:
  std::span<const uint16_t> codes_;
  size_t planeVoxels_;
};

/// Takes what a sweep makes, slab by slab; slab k of a pass is its k-th row of bricks along z.
class AttenuationSink {
 public:
  virtual ~AttenuationSink() = default;
  /// The bricks of a slab that are wanted, in any order. The planes must stay where they are until complete(). Called
  /// from one thread.
  virtual std::span<const BrickPlanes> begin(int pass, int slab) = 0;
  /// Where level 1 of the slab is to go, whatever bricks are wanted. Called from one thread, after begin().
  virtual LevelTarget levels(int /*pass*/, int /*slab*/) { return {}; }
  /// All 13 planes of all bricks of the slab are filled. Called from one thread; ends the sweep if it throws.
  virtual void complete(int pass, int slab) = 0;
};

/// For each pass, what one plane passes on (precompute/sweep_kernels.h) along its nine directions that leave planes,
/// ascending: dims.x * dims.y each, x fastest. Empty: 0.
using BorderDepths = std::array<std::vector<FixedDepth>, kSweepPasses>;
inline constexpr int kBorderDirections = 9;
/// The direction that has place `i` in there.
constexpr int borderDirection(int pass, int i) {
  return pass == 0 ? i : shared::kDirectionCount - kBorderDirections + i;
}

/// Some slabs of bricks, swept by themselves.
struct SweepPart {
  int firstSlab = 0, lastSlab = 0;  ///< firstSlab..lastSlab-1
  BorderDepths incoming;  ///< of the planes before the part, in the order of each pass; not used at the border
  /// Directions that stay within their planes are left out: for the sake of what leaves the part.
  bool bordersOnly = false;
};

/// Sweeps the directions of the passes `passes` (bit 0, bit 1) over bricks of `edge` voxels; both at once if both are
/// asked for. A voxel whose neighbour lies outside the volume has depth 0, A8 = 255.
/// What the sink receives depends neither on the number of threads nor on the instruction set. Takes sweepBytes() of
/// `memory`, whose earlier use does not matter.
void sweepAttenuation(CodePlanes& codes, glm::ivec3 dims, int edge, const SegmentDepth& segments, AttenuationSink& sink,
                      unsigned passes, SweepMemory& memory);
/// With memory of its own.
void sweepAttenuation(CodePlanes& codes, glm::ivec3 dims, int edge, const SegmentDepth& segments, AttenuationSink& sink,
                      unsigned passes = 3);

/// The same for a part of the volume; gives the depths of its last planes, in the order of each pass. Without incoming
/// depths those are what the part alone takes: saturating sums, to which depths that come in later can be added.
BorderDepths sweepPart(CodePlanes& codes, glm::ivec3 dims, int edge, const SegmentDepth& segments,
                       AttenuationSink& sink, unsigned passes, const SweepPart& part);

/// What leaves a part of so many planes along a direction: `own`, what it takes itself, plus `incoming`, moved along.
void addIncoming(std::span<const FixedDepth> incoming, int direction, int planes, glm::ivec3 dims,
                 std::span<FixedDepth> own);

/// Memory that sweepAttenuation takes beside codes and brick planes: 36 bytes per voxel of an xy plane and pass, and
/// per voxel along x about 36 edge bytes for each pass and 600 for each thread.
uint64_t sweepBytes(glm::ivec3 dims, int edge, int passCount, int threads);

}  // namespace freevoxel
