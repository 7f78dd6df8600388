// The voxel buffer: where each filled voxel's fragments start.
layout(local_size_x = 64) in;

layout(std430, binding = 0) readonly buffer Starts { uvec2 starts[]; };
layout(std430, binding = 1) writeonly buffer Voxels { uint voxelBuffer[]; };

layout(location = 0) uniform uint count;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
  if (i < count) voxelBuffer[i] = starts[i].y;
}
