// Volumes made by formula.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "volume/volume.h"

namespace freevoxel {

/// One kind of procedural volume: its name on the command line, a line of help, the type of its values.
struct ProceduralKind {
  std::string name;
  std::string description;
  ValueType type;
};

/// cube sphere ramp marschner-lobb shepp-logan cloud checkered-cloud menger kronecker shells
const std::vector<ProceduralKind>& proceduralKinds();

/// Header of what the two functions below make: unit spacing, origin 0. Throws InputError for an unknown kind or
/// invalid dims.
VolumeHeader proceduralHeader(const std::string& kind, glm::ivec3 dims);

/// Shapes are placed by fractions of the box, so any dims work and balls become ellipsoids in a box that is no cube.
/// The same `seed` gives the same bytes with any number of threads and on every machine (marschner-lobb and kronecker
/// call the C library's sine, which may differ in a last bit). Only the random kinds look at the seed. Throws
/// InputError for an unknown kind or invalid dims, MachineError if memory does not suffice.
Volume generateVolume(const std::string& kind, glm::ivec3 dims, uint64_t seed = 1);

/// Values of slices [firstSlice, firstSlice + count) alone, for volumes that do not fit memory; same bytes as
/// generateVolume's.
void generateSlices(const std::string& kind, glm::ivec3 dims, uint64_t seed, int firstSlice, int count,
                    std::span<std::byte> out);

}  // namespace freevoxel
