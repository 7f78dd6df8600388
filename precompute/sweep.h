// Attenuation of every voxel along the 26 lattice directions (papers/freevoxels section 3.1), plane by plane: a voxel's
// depth is its neighbour's, one step further out, plus the segment between them.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "precompute/segment_depth.h"

namespace freevoxel {

/// Attenuation along one direction of `planes` z planes starting at `firstPlane`: bytes[((z - firstPlane) * dims.y + y)
/// * dims.x + x], valid during the call.
struct AttenuationSlab {
  int direction = 0;
  int firstPlane = 0;
  int planes = 0;
  std::span<const uint8_t> bytes;
};

/// The 26 directions are swept in two passes of 13, upwards through the planes for directions 0..12 and downwards for
/// 13..25: opposite directions, and so the two halves of a file, never share one.
inline constexpr int kSweepPasses = 2;
constexpr int sweepPass(int direction) {
  return direction / kDirectionsPerSection;
}

/// Takes what a sweep makes.
class AttenuationSink {
 public:
  virtual ~AttenuationSink() = default;
  /// Called once for every direction and slab, from many threads at once, in an order that is not fixed. Must not
  /// throw.
  virtual void receive(const AttenuationSlab& slab) = 0;
  /// All directions of a pass have been received for the slab that starts at `firstPlane`, and nothing of the pass's
  /// next slab yet. Called from one thread; ends the sweep if it throws.
  virtual void complete(int pass, int firstPlane) = 0;
};

/// Sweeps all 26 directions and hands every slab of `slabPlanes` planes (the topmost may be thinner) of every direction
/// to `sink`. `codes` are dims.x * dims.y * dims.z value codes, x fastest. A voxel whose neighbour lies outside the
/// volume has depth 0, A8 = 255.
/// What the sink receives does not depend on the number of threads. Beside the codes this takes 72 bytes per voxel of
/// an xy plane, and slabPlanes bytes per voxel of a plane and thread.
void sweepAttenuation(std::span<const uint16_t> codes, glm::ivec3 dims, const SegmentDepth& segments, int slabPlanes,
                      AttenuationSink& sink);

}  // namespace freevoxel
