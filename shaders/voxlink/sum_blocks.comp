// Replaces every entry of a block of 256 by the sum of those before it, and tells the block's sum.
layout(local_size_x = 256) in;

layout(std430, binding = 0) buffer Entries { uvec2 entries[]; };
layout(std430, binding = 1) writeonly buffer Sums { uvec2 sums[]; };

layout(location = 0) uniform uint count;

shared uvec2 partial[256];

void main() {
  uint local = gl_LocalInvocationIndex;
  uint block = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
  uint at = block * 256u + local;
  uvec2 own = at < count ? entries[at] : uvec2(0u);
  partial[local] = own;
  barrier();
  for (uint reach = 1u; reach < 256u; reach *= 2u) {
    uvec2 before = local >= reach ? partial[local - reach] : uvec2(0u);
    barrier();
    partial[local] += before;
    barrier();
  }
  if (at < count) entries[at] = partial[local] - own;
  if (local == 255u && block * 256u < count) sums[block] = partial[255];
}
