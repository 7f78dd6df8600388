// Where bricks are found (voxlink/buffers.h). Bindings 0 and 1 and locations 0 to 4 of every pass over the buffers.
#include "shaders/shared/voxlink.h"

layout(std430, binding = 0) readonly buffer BrickWords { BrickWord brickWords[]; };
layout(std430, binding = 1) readonly buffer BrickHeaders { uint brickHeaders[]; };

layout(location = 0) uniform ivec3 boxLow;   // of the stored voxels
layout(location = 1) uniform ivec3 boxHigh;  // exclusive
layout(location = 2) uniform ivec3 gridFirst;
layout(location = 3) uniform ivec3 gridCount;
layout(location = 4) uniform int edge;

// Of the brick whose header starts there: the filled voxels of a list.
uint columnMask(uint header, int column) {
  return listMask(brickHeaders[header + uint(maskWord(column * edge))], edge, column);
}
// Number of a stored voxel, told by its bit: those of the brick before it and of all bricks before.
uint storedVoxel(uint header, int bit) {
  uint start = brickHeaders[header + uint(startWord(edge, bit))] >> startShift(bit) & 0xffffu;
  uint word = header + uint(maskWord(bit));
  uint before = uint(bitCount(brickHeaders[word] & ((1u << (bit & 31)) - 1u)));
  if ((bit & 32) != 0) before += uint(bitCount(brickHeaders[word - 1u]));
  return brickHeaders[header] + start + before;
}

// Whether a brick of the grid is occupied, and where its header starts.
bool findBrick(ivec3 brick, out uint header) {
  ivec3 b = brick - gridFirst;
  uint at = uint((b.z * gridCount.y + b.y) * gridCount.x + b.x);
  BrickWord word = brickWords[at >> 5];
  uint bit = at & 31u;
  uint rank = word.rank + uint(bitCount(word.occupied & ((1u << bit) - 1u)));
  header = rank * uint(headerWords(edge));
  return (word.occupied >> bit & 1u) != 0u;
}

// Number of the stored voxel at a place; false if none is.
bool findVoxel(ivec3 voxel, out uint stored) {
  ivec3 at = clamp(voxel, boxLow, boxHigh - 1);
  uint header;
  bool occupied = findBrick(at / edge, header);
  ivec3 local = at % edge;
  int column = local.y * edge + local.x;
  stored = 0u;
  if (!occupied || at != voxel || (columnMask(header, column) >> local.z & 1u) == 0u) return false;
  stored = storedVoxel(header, column * edge + local.z);
  return true;
}
