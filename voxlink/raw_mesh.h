// A mesh as a file has it, before anything is known of it.
#pragma once

#include <string>

#include "voxlink/read_mesh.h"

namespace freevoxel {

/// Like MeshFile, but only the sizes of the arrays fit each other.
using RawMesh = MeshFile;

/// Leaves out what Mesh does not allow, and counts it; joins vertices in the same place if `join`. Throws InputError
/// for indices beyond their arrays, and if no triangle is left.
MeshFile tidied(RawMesh raw, bool join, const std::string& path);

/// A polygon's triangles, all with its first corner: right for convex ones.
template <class Polygon>
void addFan(const Polygon& corners, uint32_t material, Mesh& mesh) {
  for (size_t i = 2; i < corners.size(); ++i) {
    mesh.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    mesh.materialOfTriangle.push_back(material);
  }
}

}  // namespace freevoxel
