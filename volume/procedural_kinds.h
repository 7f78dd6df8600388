// The generators behind generateVolume.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>

namespace freevoxel {

/// Fills the values of slice z, x fastest, in this machine's byte order. Called from several threads at once.
using SliceGenerator = std::function<void(int z, std::byte* out)>;

// Shapes (procedural_shapes.cpp).
SliceGenerator cubeGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator sphereGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator rampGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator marschnerLobbGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator sheppLoganGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator mengerGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator shellsGenerator(glm::ivec3 dims, uint64_t seed);

// Random fields (procedural_fields.cpp).
SliceGenerator cloudGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator checkeredCloudGenerator(glm::ivec3 dims, uint64_t seed);
SliceGenerator kroneckerGenerator(glm::ivec3 dims, uint64_t seed);

}  // namespace freevoxel
