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

/// Change of code at voxel p per voxel along each axis of the array: central differences, one-sided at the border.
glm::vec3 indexGradient(const ValueGrid& grid, glm::ivec3 p);
/// Takes that to change of value per shortest voxel edge, as a share of the range of codes, in world axes.
glm::dmat3 gradientFromDifferences(const ValueGrid& grid);
/// Both together.
glm::vec3 gradientAt(const ValueGrid& grid, glm::ivec3 p);

}  // namespace freevoxel
