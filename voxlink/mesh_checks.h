// What Assimp does not notice of a mesh file.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace freevoxel {

// Run before Assimp reads the file: it takes files cut between two lines, or faces with too few corners, as whole. Each
// throws InputError with line or offset.

/// Every v, vn, vt has its numbers, every face at least three corners, every corner numbers what is there, and the file
/// does not end in the middle of a line. (Cut between two lines it is a shorter file.) Returns the number of v.
uint64_t checkObj(std::string_view text, const std::string& path);

/// Binary: 84 bytes and 50 per triangle; text: from solid to endsolid, with whole facets.
void checkStl(std::string_view bytes, const std::string& path);

/// JSON, or a GLB as long as its header says, that requires no extension which changes where triangles are. (That
/// buffers are there and accessors inside them Assimp checks.)
void checkGltf(std::string_view bytes, const std::string& path);

}  // namespace freevoxel
