// From a block's voxels to kernel splats (papers/freevoxels sections 3.3 and 5; DESIGN section 3, footprint `kernel`).
#pragma once

#include <cstdint>
#include <vector>

#include "shaders/shared/kernel_splat.h"
#include "splat/block_source.h"
#include "splat/volume_view.h"
#include "volume/transfer_function.h"

namespace freevoxel {

using shared::KernelSplat;
static_assert(sizeof(KernelSplat) == 48 && offsetof(KernelSplat, conicXX) == 16 &&
                  offsetof(KernelSplat, emissionR) == 32,
              "vertex attributes are read at these offsets");

/// A splat and how far its voxel is from the eye (orthographic: from the eye's plane), in shortest voxel edges.
struct BlendSplat {
  KernelSplat splat;
  float distance;
};

/// What weight 1 of a splat emits, before colour and attenuation.
enum class KernelEmission {
  telescoping,  ///< (1 - T^l) / l per length, so that a slab emits 1 - exp(-sigma L) from every view
  opacity,      ///< 1 - T per length: the paper's
  peak,         ///< 1 - T^l at the splat's centre, whatever its size: of sprites that are not normalised
};

/// Everything about a frame that its splats need. Built once per frame, then read by all threads.
class KernelSetup {
 public:
  /// `classified[code]` for every code of the file; emission is divided by `quantum`; voxels with attenuation below
  /// `hiddenBelow` are dropped.
  KernelSetup(const VolumeView& view, std::vector<Classified> classified, KernelEmission emission, float quantum,
              float hiddenBelow);

  struct Counts {
    uint64_t culledSplats = 0, hiddenSplats = 0;
    uint64_t fragments = 0;
  };

  /// Appends the splats of the visible voxels of a block of edge^3 voxels that touch the image, x fastest. `dims`: of
  /// the block's level, which is that of the view.
  void append(const BlockSamples& samples, const VisibleBlock& block, glm::ivec3 dims, int edge,
              std::vector<KernelSplat>& splats, Counts& counts) const;
  void appendWithDistance(const BlockSamples& samples, const VisibleBlock& block, glm::ivec3 dims, int edge,
                          std::vector<BlendSplat>& splats, Counts& counts) const;

  /// Whether a splat of this block could touch the image. Never false for one that would.
  bool mayTouchImage(glm::ivec3 origin, int edge) const;

 private:
  /// Way through the volume per plane of voxels towards a direction of view space.
  float lengthPerPlane(glm::dvec3 towards) const;
  /// Calls keep(splat, index) for the block's visible voxels.
  template <class Keep>
  void forEachSplat(const BlockSamples& samples, const VisibleBlock& block, glm::ivec3 dims, int edge, Counts& counts,
                    Keep&& keep) const;
  Classified classify(const BlockSamples& samples, size_t at) const;
  bool makeSplat(glm::ivec3 index, const Classified& voxel, float attenuation, KernelSplat& splat,
                 Counts& counts) const;

  VolumeView view_;
  std::vector<Classified> classified_;
  KernelEmission emission_;
  float inverseQuantum_;
  float hiddenBelow_;
  float orthographicPower_ = 1.0f;
  double cellDiagonal_ = 0.0;  ///< longest diagonal of a cell, in shortest voxel edges
  double kernelReach_ = 0.0;   ///< how far a kernel reaches from its voxel, at most
};

}  // namespace freevoxel
