// How the voxels of a volume land on the image of a camera.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "base/camera.h"
#include "base/placement.h"

namespace freevoxel {

/// A volume seen by a camera, with lengths in shortest voxel edges. View space has its origin at the eye.
struct VolumeView {
  glm::dmat3 viewFromIndex;  ///< columns: the three voxel edges in view space
  glm::dvec3 viewOrigin;     ///< view position of voxel (0,0,0)
  glm::dmat3 indexFromView;  ///< inverse of viewFromIndex
  double voxelVolume;        ///< V, in cubed shortest voxel edges
  double pixelsPerUnit;      ///< perspective: focal length in pixels; orthographic: pixels per shortest voxel edge
  glm::dvec2 centre;         ///< of the image, pixels
  glm::ivec2 imageSize;
  bool orthographic;

  glm::dvec3 viewPosition(glm::dvec3 index) const { return viewOrigin + viewFromIndex * index; }
};

/// The same for the voxels of a level, of 2^level edges an edge; lengths stay in shortest edges of the finest one.
VolumeView ofLevel(const VolumeView& finest, int level);

VolumeView volumeView(const Placement& placement, const Camera& camera);

/// The smallest distance along the line of sight, in shortest voxel edges, at which a kernel splat is drawn in
/// perspective: nearer voxels would be larger than the image and stand for what is around the eye.
inline constexpr double kNearestKernel = 1.0;

/// Index of the lattice direction nearest by angle to `towards` (the paper's look-up); `edges` are the voxel edges, in
/// the space and unit of `towards`.
int nearestDirection(const glm::dmat3& edges, glm::dvec3 towards);

}  // namespace freevoxel
