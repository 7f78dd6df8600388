#extension GL_ARB_gpu_shader_int64 : require
// The voxels of one column that a triangle touches.
#include "shaders/voxlink/triangle.glsl"
#include "shaders/voxlink/voxelise.glsl"

layout(std430, binding = 3) readonly buffer Triangles { SnappedTriangle triangles[]; };

layout(location = 3) uniform int axis;

flat in uint number;

void main() {
  SnappedTriangle t = triangles[number];
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  ivec3 low = lowOf(t), high = highOf(t);
  ivec3 first = firstVoxel(low), last = lastVoxel(high, dims);
  WideNormal normal = normalOf(t);
  int64_t facing = along(normal, axis);
  // From the column's pixel to VoxLink space.
  ivec3 voxel = first;
  voxel[u] = int(gl_FragCoord.x);
  voxel[v] = int(gl_FragCoord.y);
  ivec3 centre = voxel * kSubvoxels + kHalf;
  if (!touchesAlong(t, axis, facing, centre)) return;
  float height = -float(aboveOf(t, normal, centre)) / float(facing);
  int middle = int(floor((float(centre[axis]) + height) / float(kSubvoxels)));
  int end = min(last[axis], middle + 2);
  for (int w = max(first[axis], middle - 2); w <= end; ++w) {
    voxel[axis] = w;
    if (touches(t, normal, low, high, voxel)) emit(voxel, t.key, number);
  }
}
