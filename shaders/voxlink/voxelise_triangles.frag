#extension GL_ARB_gpu_shader_int64 : require
// The voxels of one column that a triangle touches.
#include "shaders/voxlink/triangle.glsl"
#include "shaders/voxlink/voxelise.glsl"

layout(std430, binding = 3) readonly buffer Triangles { SnappedTriangle triangles[]; };

layout(location = 3) uniform int axis;

flat in uint number;

void main() {
  SnappedTriangle t = triangles[number];
  ivec3 low = lowOf(t), high = highOf(t);
  ivec3 first = firstVoxel(low), last = lastVoxel(high, dims);
  WideVector normal = normalOf(t);
  int64_t facing = along(normal, axis);
  // From the column's pixel to VoxLink space.
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  int bottom = along(first, axis), top = along(last, axis);
  ivec3 centre = turnedBack(ivec3(pixel, bottom), axis) * kSubvoxels + kHalf;
  if (!touchesAlong(t, axis, facing, centre)) return;
  float height = -float(aboveOf(t, normal, centre)) / float(facing);
  int middle = int(floor((float(along(centre, axis)) + height) / float(kSubvoxels)));
  int end = min(top, middle + 2);
  for (int w = max(bottom, middle - 2); w <= end; ++w) {
    ivec3 voxel = turnedBack(ivec3(pixel, w), axis);
    if (touches(t, normal, low, high, voxel)) emit(voxel, t.key, number);
  }
}
