#include "splat/volume_view.h"

#include <cmath>
#include <glm/glm.hpp>

#include "shaders/shared/directions.h"

namespace freevoxel {

VolumeView volumeView(const Placement& placement, const Camera& camera) {
  const ViewFrame frame = viewFrame(camera);
  const double unit = placement.unitLength();
  VolumeView view;
  for (int axis = 0; axis < 3; ++axis) {
    view.viewFromIndex[axis] = frame.viewFromWorld * (placement.direction[axis] * (placement.spacing[axis] / unit));
  }
  view.viewOrigin = frame.viewFromWorld * ((placement.origin - frame.eye) / unit);
  view.indexFromView = glm::inverse(view.viewFromIndex);
  view.voxelVolume = std::abs(glm::determinant(view.viewFromIndex));
  view.pixelsPerUnit = frame.orthographic ? frame.pixelsPerUnit * unit : frame.pixelsPerUnit;
  view.centre = frame.centre;
  view.imageSize = camera.imageSize;
  view.orthographic = frame.orthographic;
  return view;
}

VolumeView ofLevel(const VolumeView& finest, int level) {
  VolumeView view = finest;
  const double voxels = double(1 << level);
  view.viewOrigin += finest.viewFromIndex * glm::dvec3(0.5 * (voxels - 1.0));
  view.viewFromIndex *= voxels;
  view.indexFromView /= voxels;
  view.voxelVolume *= voxels * voxels * voxels;
  return view;
}

int nearestDirection(const glm::dmat3& edges, glm::dvec3 towards) {
  int nearest = 0;
  double best = -2.0;
  for (int k = 0; k < shared::kDirectionCount; ++k) {
    const glm::dvec3 direction =
        edges * glm::dvec3(shared::directionX(k), shared::directionY(k), shared::directionZ(k));
    const double cosine = glm::dot(direction, towards) / glm::length(direction);
    if (cosine > best) {
      best = cosine;
      nearest = k;
    }
  }
  return nearest;
}

}  // namespace freevoxel
