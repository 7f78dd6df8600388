// What 26 directions miss, put right by a small copy of the volume (docs/fidelity.md, "Corrected attenuation").
//
// Directions 45 degrees apart know a translucent volume's large shapes only roughly from in between. A copy of the
// volume, a few voxels to one, is cheap to sweep for the direction wanted and for the 26; the ratio of what its sweep
// and its own 26 directions say is how wrong the stored ones are there, shared by the fine voxels.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "splat/attenuation_grid.h"

namespace freevoxel {

class CoarseVolume {
 public:
  /// `ofCode[code]` for every code of the grid.
  CoarseVolume(const ValueGrid& grid, std::span<const Classified> ofCode);

  /// Multiplies stored attenuation towards a target by the ratio.
  void correct(const Towards& towards, AttenuationGrid& attenuation) const;

 private:
  void reduce(const ValueGrid& grid, std::span<const Classified> ofCode);
  void sweepDirections();
  /// The ratio at every coarse voxel.
  std::vector<float> ratios(const Towards& coarse) const;

  int factor_ = 2;  ///< fine voxels along the edge of a coarse one
  glm::ivec3 fineDims_{0};
  ValueGrid grid_;  ///< codes stand for mean extinction
  ClassificationTable table_;
  VisibleCubes cubes_;
  std::vector<float> extinction_;              ///< per coarse voxel, log2 per coarse edge
  std::array<std::vector<float>, 26> depths_;  ///< log2, towards each direction, one edge per plane
};

}  // namespace freevoxel
