// Entries of voxels, each voxel's one after the other in no order. One invocation per entry.
layout(std430, binding = 0) readonly buffer Table { uvec2 table[]; };  // filled voxels before this one; end of its entries
layout(std430, binding = 1) buffer Entries { uvec4 entries[]; };       // see voxelise.glsl; w: whether first of its key
layout(std430, binding = 2) buffer Starts { uvec2 starts[]; };         // y: fragments per filled voxel; or before

layout(location = 0) uniform uint count;

uint entryNumber() {
  return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
}
uint firstEntry(uint place) {
  return place == 0u ? 0u : table[place - 1u].y;
}
