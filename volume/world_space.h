// From the spaces that files are written in to ours (docs/conventions.md).
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <string>

#include "base/placement.h"

namespace freevoxel {

/// What the axes of a file's world mean. Ours is `ras`: x to the patient's right, y to the front, z to the head; a file
/// that says nothing of a patient is taken as it stands.
enum class FileSpace {
  ras,         ///< right, anterior, superior: NIfTI
  lps,         ///< left, posterior, superior: DICOM, MetaImage, most NRRD
  las,         ///< left, anterior, superior: left-handed
  leftHanded,  ///< no patient, left-handed: z is turned round, so that nothing is mirrored
  unnamed,     ///< right-handed, whatever it means
};

/// A placement from the three voxel edges (columns, with their lengths) and the centre of the first voxel, both in a
/// file's space. Throws InputError "`where`: ..." where an edge has no length or the three lie in one plane.
Placement placeInWorld(const glm::dmat3& edges, glm::dvec3 origin, FileSpace space, const std::string& where);

}  // namespace freevoxel
