// What bricks that a file left out may hold.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <unordered_map>
#include <vector>

#include "hierarchy/attenuation_file.h"

namespace freevoxel {

/// Codes of a stored brick at its eight outermost voxels inside the volume: bit 0 of the index for x, 1 for y, 2 for z,
/// set for the last one along that axis.
using CornerCodes = std::array<uint16_t, 8>;

/// One code for each brick that is not stored, such that every cell that was invisible still is: `corners[i]` is that
/// of brick i, x fastest; `stored[i]` whether it is. `bricks`: along each axis. Stored bricks get 0.
///
/// A stored voxel next to an absent one shares an invisible cell with it, so both lie in one interval of values that is
/// invisible throughout; and absent voxels that touch lie in one such interval too. Any code from that interval is
/// therefore as good as the lost one, and a neighbour's is in it.
std::vector<uint16_t> absentBrickCodes(glm::ivec3 bricks, const std::vector<uint8_t>& stored,
                                       const std::vector<CornerCodes>& corners);

/// The eight codes of a stored brick of a file. Throws InputError if it is damaged.
CornerCodes cornerCodes(const AttenuationFile& file, size_t brick);

/// The same codes, of one brick after the other as they are needed: only the stored bricks that they come from are
/// read.
class AbsentBricks {
 public:
  /// Looks at the directory alone. `file` must outlive it.
  explicit AbsentBricks(const AttenuationFile& file);
  /// Reads what the codes of these bricks (voxel / edge) come from; stored ones are passed over. Throws InputError.
  void read(std::span<const glm::ivec3> positions);
  /// Of a brick that was among those read and is not stored.
  uint16_t code(glm::ivec3 position) const;

 private:
  const AttenuationFile& file_;
  glm::ivec3 bricks_;
  std::vector<uint64_t> sources_;
  std::unordered_map<uint64_t, CornerCodes> corners_;  ///< of stored bricks, by linear index
};

}  // namespace freevoxel
