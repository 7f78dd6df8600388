// All values of a volume as codes in one array, for what needs random access to them.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "hierarchy/attenuation_file.h"
#include "volume/value_codes.h"
#include "volume/volume.h"

namespace freevoxel {

/// Codes of a whole volume. Where an attenuation file stored nothing, because nothing is visible there, codes are made
/// up from the nearest stored ones such that every cell that was invisible still is.
struct ValueGrid {
  glm::ivec3 dims{0};
  Placement placement;
  ValueCoding coding;
  std::vector<uint16_t> codes;  ///< x fastest
};

/// Codes over the transfer function's range.
ValueGrid valueGrid(const Volume& volume, const TransferFunction& transfer);
ValueGrid valueGrid(const AttenuationFile& file);

/// Change of value at voxel p per shortest voxel edge, as a share of the range of codes, in world axes: central
/// differences, one-sided at the border.
glm::vec3 gradientAt(const ValueGrid& grid, glm::ivec3 p);
/// From a change of code per voxel along each axis of the array to what gradientAt gives: a matrix to multiply it with.
glm::dmat3 gradientFromDifferences(const ValueGrid& grid);

}  // namespace freevoxel
