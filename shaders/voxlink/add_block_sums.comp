// Adds to every entry of a block of 256 the sum of the blocks before it.
layout(local_size_x = 256) in;

layout(std430, binding = 0) buffer Entries { uvec2 entries[]; };
layout(std430, binding = 1) readonly buffer Sums { uvec2 sums[]; };

layout(location = 0) uniform uint count;

void main() {
  uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint at = block * 256u + gl_LocalInvocationIndex;
  if (at < count) entries[at] += sums[block];
}
