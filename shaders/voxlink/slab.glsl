// Slices of a volume on their way into bricks: one layer of bricks and a slice on either side for gradients. One group
// per brick of the layer.
#include "shaders/shared/voxlink.h"

// Two codes of 16 bits a word, x fastest.
layout(std430, binding = 0) readonly buffer Slab { uint slab[]; };
// A bit per code: whether voxels of it are stored.
layout(std430, binding = 1) readonly buffer Stored { uint storedBits[]; };

layout(location = 0) uniform ivec3 dims;
layout(location = 1) uniform int slabZ;  // its first slice
layout(location = 2) uniform int edge;
layout(location = 3) uniform int layer;  // of bricks

uint codeAt(ivec3 voxel) {
  uint at = uint(((voxel.z - slabZ) * dims.y + voxel.y) * dims.x + voxel.x);
  return slab[at >> 1] >> (16u * (at & 1u)) & 0xffffu;
}

bool isStored(uint code) {
  return (storedBits[code >> 5] >> (code & 31u) & 1u) != 0u;
}

ivec3 brickOrigin() {
  return ivec3(gl_WorkGroupID.xy, layer) * edge;
}

// Among all bricks of the volume, x fastest.
uint brickIndex() {
  ivec3 bricks = (dims + edge - 1) / edge;
  return (uint(layer) * uint(bricks.y) + gl_WorkGroupID.y) * uint(bricks.x) + gl_WorkGroupID.x;
}

// The filled voxels of a column of a brick.
uint columnMask(ivec3 origin, int column) {
  ivec3 voxel = origin + ivec3(column % edge, column / edge, 0);
  uint mask = 0u;
  if (voxel.x >= dims.x || voxel.y >= dims.y) return mask;
  int size = min(edge, dims.z - origin.z);
  for (int z = 0; z < size; ++z)
    mask |= isStored(codeAt(voxel + ivec3(0, 0, z))) ? 1u << z : 0u;
  return mask;
}
