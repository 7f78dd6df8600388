#extension GL_ARB_gpu_shader_int64 : require
// Packs what was added up of triangles.
layout(local_size_x = 64) in;

layout(std430, binding = 10) readonly buffer DirectionTable { float directionTable[]; };
#define DIRECTION_TABLE(i) directionTable[i]
#include "shaders/shared/direction_code.h"
#include "shaders/voxlink/parts.glsl"

layout(std430, binding = 9) buffer Fragments { SceneFragment fragmentBuffer[]; };

layout(location = 0) uniform uint count;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
  if (i >= count) return;
  uint key = fragmentBuffer[i].head;
  if (fragmentKind(key) != kTriangles) return;
  ivec3 mean = meanPlane(i);
  ivec3 normal = ivec3(sums[8u * i + 3u], sums[8u * i + 4u], sums[8u * i + 5u]);
  ivec3 size = abs(normal);
  int shift = max(0, findMSB(uint(max(max(size.x, size.y), size.z))) + 1 - 20);
  uint direction = packDirection(float(normal.x >> shift), float(normal.y >> shift), float(normal.z >> shift));
  fragmentBuffer[i] =
      SceneFragment(kTriangles | key >> 3 << 16 | direction, planeOf(key & 7u, mean.x, mean.y, mean.z, sums[8u * i + 7u]));
}
