// The 26 stored directions, looked up towards one target, a brick at a time.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "hierarchy/attenuation_file.h"
#include "splat/attenuation_grid.h"

namespace freevoxel {

/// How the 26 stored directions answer for one in between.
enum class StoredLookup {
  interpolated,  ///< face, edge and corner direction of its octant triangle (DESIGN section 3, look-up of A)
  nearest,       ///< the one nearest by angle, as the paper has it
  quotient,      ///< interpolated, and divided by the same at the target's own voxel, if that lies in the volume: the
                 ///< paper's A_B / A_V (section 2.1). 1 where both are 0.
};

class StoredAttenuation {
 public:
  /// `file` must outlive this. `towards`: in the index space of the finest level; `level`: of the bricks.
  StoredAttenuation(const AttenuationFile& file, const Towards& towards, StoredLookup lookup, int level = 0);

  /// The stored directions that `look` needs of the brick that begins with this voxel of the level.
  DirectionSet directions(glm::ivec3 brickOrigin) const;

  /// Attenuation, 0..1, at every step along the brick's curve; edge^3 entries. Voxels outside the volume get any number
  /// in that range. May be called from many threads.
  void look(const BrickView& brick, std::span<float> attenuation) const;

 private:
  void lookNearest(const BrickView& brick, std::span<float> attenuation) const;
  void lookOneByOne(const BrickView& brick, std::span<float> attenuation) const;
  int nearest(glm::dvec3 voxel) const;
  float divisor(glm::dvec3 towardsTarget) const;

  const AttenuationFile& file_;
  Towards towards_;
  StoredLookup lookup_;
  glm::dmat3 squaredLength_;  ///< u . (squaredLength_ u) is the squared length of u
  /// Codes of the target's own voxel, for `quotient`; nothing if it lies outside the volume or is not stored.
  std::optional<std::array<uint8_t, 26>> atTarget_;
};

/// The same for the whole volume; 1 where the file stored nothing.
AttenuationGrid storedAttenuation(const AttenuationFile& file, const Towards& towards, StoredLookup lookup);

}  // namespace freevoxel
