// What 26 directions miss, put right by a small copy of the volume (docs/fidelity.md, "Corrected attenuation").
//
// Directions 45 degrees apart know a translucent volume's large shapes only roughly from in between. A copy of the
// volume, a few voxels to one, is cheap to sweep for the direction wanted and for the 26; the ratio of what its sweep
// and its own 26 directions say is how wrong the stored ones are there, shared by the fine voxels.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "hierarchy/attenuation_file.h"
#include "splat/attenuation_grid.h"

namespace freevoxel {

/// How wrong stored attenuation towards one target is, all over the volume.
class CoarseRatio {
 public:
  /// Multiplies the attenuation of a box of voxels of a level, x fastest, by the ratio there. `first`: its first voxel.
  void correct(glm::ivec3 first, glm::ivec3 size, int level, std::span<uint16_t> attenuations) const;
  uint64_t bytes() const { return ratios_.size() * sizeof(float); }

 private:
  friend class CoarseVolume;
  int factor_ = 1;  ///< finest voxels along the edge of one of its own
  glm::ivec3 dims_{0};
  std::vector<float> ratios_;
};

class CoarseVolume {
 public:
  /// `ofCode[code]` for every code of the grid.
  CoarseVolume(const ValueGrid& grid, std::span<const Classified> ofCode);
  /// The same from a file, which reads all of its codes. Throws InputError if it is damaged.
  CoarseVolume(const AttenuationFile& file, std::span<const Classified> ofCode);

  CoarseRatio ratio(const Towards& towards) const;
  /// Multiplies stored attenuation towards a target by the ratio.
  void correct(const Towards& towards, AttenuationGrid& attenuation) const;
  /// What the copy of a volume takes in memory, with one ratio, about.
  static uint64_t bytesFor(glm::ivec3 fineDims);

 private:
  explicit CoarseVolume(glm::ivec3 fineDims);
  /// From extinction_, in place until then: codes, table, visible cubes, and the directions.
  void finish();
  void reduce(const ValueGrid& grid, std::span<const Classified> ofCode);
  void sweepDirections();

  int factor_ = 2;  ///< fine voxels along the edge of a coarse one
  glm::ivec3 fineDims_{0};
  ValueGrid grid_;  ///< codes stand for mean extinction
  ClassificationTable table_;
  VisibleCubes cubes_;
  std::vector<float> extinction_;              ///< per coarse voxel, log2 per coarse edge
  std::array<std::vector<float>, 26> depths_;  ///< log2, towards each direction, one edge per plane
};

}  // namespace freevoxel
