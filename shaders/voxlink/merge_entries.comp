#extension GL_ARB_gpu_shader_int64 : require
// Finds the fragment of each entry: as many keys of its voxel as are smaller come before it. Spheres and samples are
// written, triangles added up.
layout(local_size_x = 64) in;

#include "shaders/voxlink/entries.glsl"
#include "shaders/voxlink/parts.glsl"

layout(std430, binding = 9) writeonly buffer Fragments { SceneFragment fragmentBuffer[]; };
layout(std430, binding = 10) readonly buffer Samples { uint samples[]; };

void main() {
  uint i = entryNumber();
  if (i >= count) return;
  uvec4 entry = entries[i];
  uint end = table[entry.x].y;
  uint fragment = starts[table[entry.x].x].y;
  for (uint j = firstEntry(entry.x); j < end; ++j) {
    uvec2 other = entries[j].yw;
    if (other.y == 1u && other.x < entry.y) ++fragment;
  }
  fragmentOfEntry[i] = fragment;
  uint kind = fragmentKind(entry.y);
  if (kind == kSphere) {
    fragmentBuffer[fragment] = SceneFragment(entry.y, 0u);
    return;
  }
  if (kind == kVolume) {
    fragmentBuffer[fragment] = SceneFragment(kVolume | (entry.y & 0x3fffu) << 16, samples[3u * entry.z + 2u]);
    return;
  }
  if (entry.w == 1u) fragmentBuffer[fragment] = SceneFragment(entry.y, 0u);
  TrianglePart part = partOf(entry.z, voxelAt(entry.x));
  atomicAdd(sums[8u * fragment], part.slopeU);
  atomicAdd(sums[8u * fragment + 1u], part.slopeV);
  atomicAdd(sums[8u * fragment + 2u], part.height);
  atomicAdd(sums[8u * fragment + 3u], part.normal.x);
  atomicAdd(sums[8u * fragment + 4u], part.normal.y);
  atomicAdd(sums[8u * fragment + 5u], part.normal.z);
  atomicAdd(sums[8u * fragment + 6u], 1);
}
