// What bricks that a file left out may hold.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
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

/// The same from a file, which reads all of its codes.
std::vector<uint16_t> absentBrickCodes(const AttenuationFile& file);

}  // namespace freevoxel
