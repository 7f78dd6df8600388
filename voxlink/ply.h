// PLY files.
#pragma once

#include <string>
#include <string_view>

#include "voxlink/raw_mesh.h"

namespace freevoxel {

/// Versions 1.0, ASCII and binary of either byte order: elements vertex (x, y, z; normals nx, ny, nz; the mean of red,
/// green, blue becomes the material's colour) and face (vertex_indices or vertex_index); others are passed over. Every
/// value is there and nothing follows, or InputError names the line or the offset. Not through Assimp, whose reader
/// hangs on a file cut after its header and takes others for complete.
RawMesh readPly(std::string_view bytes, const std::string& path);

}  // namespace freevoxel
