// The voxels that volumes fill.
layout(local_size_x = 64) in;

#include "shaders/shared/scene_voxel.h"
#include "shaders/voxlink/voxelise.glsl"

// x | y << 16, z | volume << 16, body
layout(std430, binding = 3) readonly buffer Samples { uint samples[]; };

layout(location = 3) uniform uint count;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
  if (i >= count) return;
  uint xy = samples[3u * i], zVolume = samples[3u * i + 1u];
  emit(ivec3(xy & 0xffffu, xy >> 16, zVolume & 0xffffu), kVolume | zVolume >> 16, i);
}
