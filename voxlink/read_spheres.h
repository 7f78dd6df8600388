// Files of particles and atoms.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "voxlink/spheres.h"

namespace freevoxel {

struct SphereOptions {
  /// Of every sphere, whatever the file says, > 0. Unset: the file's, van der Waals radii of atoms, or, where a file
  /// has none, a 200th of the longest edge of the centres' box.
  std::optional<float> radius;
  bool copies = true;  ///< of PDB: the whole assembly that REMARK 350 describes, not only the part in the file
};

/// What was found, and what of it was left out.
struct SphereReport {
  std::string format;
  uint64_t fileSpheres = 0;        ///< rows or atoms
  uint64_t copies = 1;             ///< that the file asks for of each (of its chains)
  uint64_t nonFinite = 0;          ///< left out: a place or radius is not finite
  uint64_t withoutRadius = 0;      ///< left out: radius 0 or below
  std::vector<std::string> notes;  ///< one line each
};

struct SphereFile {
  Spheres spheres;
  SphereReport report;
};

/// Whether a file is taken for spheres, by its name: .csv, .xyz, .pdb, .ent, .npy, and the same with .gz.
bool isSphereFile(const std::string& path);

/// "CSV, XYZ, ...", for messages.
const char* sphereFormatNames();

/// Reads CSV (x, y, z, and r, material, or r and red, green, blue), XYZ (the first frame), PDB (the first model) and
/// NumPy arrays (rows of 3 or 4: x, y, z, r); docs/meshes.md says what of each. Atoms have their elements' usual
/// colours, one material per element. Copies follow one another. Throws InputError (damaged, or nothing left to see) or
/// MachineError.
SphereFile readSpheres(const std::string& path, const SphereOptions& options = {});

}  // namespace freevoxel
