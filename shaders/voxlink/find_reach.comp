#extension GL_ARB_gpu_shader_int64 : require
// How far the triangles of a fragment are from its mean plane.
layout(local_size_x = 64) in;

#include "shaders/voxlink/entries.glsl"
#include "shaders/voxlink/parts.glsl"

void main() {
  uint i = entryNumber();
  if (i >= count) return;
  uvec4 entry = entries[i];
  if (fragmentKind(entry.y) != kTriangles) return;
  uint fragment = fragmentOfEntry[i];
  ivec3 mean = meanPlane(fragment);
  TrianglePart part = partOf(entry.z, voxelAt(entry.x));
  atomicMax(sums[8u * fragment + 7u],
            planesApart(part.slopeU, part.slopeV, part.height, mean.x, mean.y, mean.z));
}
