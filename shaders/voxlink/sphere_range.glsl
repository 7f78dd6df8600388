// A sphere on the grid of subvoxels (voxlink/scene_voxels.h, rangeOf and touches).
#include "shaders/shared/scene_voxel.h"

layout(std430, binding = 3) readonly buffer Spheres { SceneSphere spheres[]; };

void snapSphere(uint number, out ivec3 centre, out int radius) {
  SceneSphere s = spheres[number];
  float scale = float(kSubvoxels);
  centre = ivec3(snapped(s.x, 0.0, scale), snapped(s.y, 0.0, scale), snapped(s.z, 0.0, scale));
  radius = snapped(s.radius, 0.0, scale);
}
ivec3 firstOf(ivec3 centre, int radius) {
  return max(ivec3(0), centre - radius - 3) / kSubvoxels;
}
ivec3 lastOf(ivec3 centre, int radius, ivec3 size) {
  return min(max(ivec3(0), centre + radius + 3) / kSubvoxels, size - 1);
}
