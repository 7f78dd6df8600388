// Blocks out of arrays of the whole volume: for attenuation that is swept.
#pragma once

#include "splat/attenuation_grid.h"
#include "splat/block_source.h"

namespace freevoxel {

/// Of level 0 only.
class GridBlockSource final : public BlockSource {
 public:
  /// All must outlive the source. `attenuation` may be null: nothing is in the way of anything.
  GridBlockSource(const ValueGrid& grid, const AttenuationGrid* attenuation, const LightGrid& light, int edge)
      : grid_(grid), attenuation_(attenuation), light_(light), edge_(edge) {}

  int edge() const override { return edge_; }
  glm::ivec3 dims(int level) const override;
  void prepare(std::span<const VisibleBlock> /*blocks*/) override {}
  void gather(const VisibleBlock& block, BlockSamples& samples) const override;
  uint64_t volumeBytes() const override;
  bool lit() const override { return !light_.empty(); }

 private:
  const ValueGrid& grid_;
  const AttenuationGrid* attenuation_;
  const LightGrid& light_;
  int edge_;
};

/// Attenuation beyond the volume, towards the target: nothing is in the way there. `openLow`, `openHigh`: faces of the
/// volume's box that light passes on its way to the target. `attenuations`: blockVoxels(edge).
void openApron(glm::bvec3 openLow, glm::bvec3 openHigh, glm::ivec3 dims, glm::ivec3 origin, int edge,
               std::span<uint16_t> attenuations);

}  // namespace freevoxel
