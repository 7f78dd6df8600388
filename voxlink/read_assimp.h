// Meshes read by Assimp, in a child process only.
#pragma once

#include <string>

#include "voxlink/raw_mesh.h"

namespace freevoxel {

enum class AssimpFormat : uint32_t { obj, stl, gltf };

/// Throws InputError, with what Assimp says.
RawMesh readWithAssimp(const std::string& path, AssimpFormat format);

/// Mean colour, linear, and mean alpha of a picture's texels: of a file, or of a file's bytes named so. Throws
/// InputError.
struct MeanColour {
  glm::vec3 linear{1.0f};
  float alpha = 1.0f;
};
MeanColour meanOfTexture(const std::string& path);
MeanColour meanOfTexture(const std::string& name, std::string_view bytes);

}  // namespace freevoxel
