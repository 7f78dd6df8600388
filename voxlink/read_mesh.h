// Mesh files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "voxlink/mesh.h"

namespace freevoxel {

/// What was found, and what of it was left out.
struct MeshReport {
  std::string format;
  uint64_t fileVertices = 0;         ///< as the file counts them
  uint64_t fileTriangles = 0;        ///< polygons with more corners as the triangles that they make
  uint64_t nonFiniteVertices = 0;    ///< left out with their triangles
  uint64_t nonFiniteTriangles = 0;   ///< left out for such a vertex
  uint64_t degenerateTriangles = 0;  ///< left out: area 0
  uint64_t linesAndPoints = 0;       ///< left out
  std::vector<std::string> notes;    ///< one line each: files that are missing, what has been made simpler
};

struct MeshFile {
  Mesh mesh;
  MeshReport report;
};

/// Whether a file is taken for a mesh, by its name: .ply, .obj, .stl, .gltf, .glb, and the same with .gz.
bool isMeshFile(const std::string& path);

/// "PLY, OBJ, ...", for messages.
const char* meshFormatNames();

/// Reads PLY here, OBJ, STL and glTF through Assimp in a child process (volume/child_process.h); docs/meshes.md says
/// what of each. The file itself may be gzip compressed, not those it names. Vertices keep the order of the file where
/// it has one; those of STL, and of OBJ without normals, are joined where they are in the same place.
/// Colours: base colour, linear; of textures the mean (of all texels, whatever the triangles use of them).
/// Throws InputError (damaged, or nothing left to see) or MachineError.
MeshFile readMesh(const std::string& path);

/// Area-weighted normals at the vertices in place of those there are.
void makeSmoothNormals(Mesh& mesh);

/// The argument that makes the program a reader of meshes.
inline constexpr const char* kMeshReaderArgument = "--read-mesh-with-library";

/// The child: reads the request from standard input, answers, ends the process.
[[noreturn]] void runMeshReader();

}  // namespace freevoxel
