// Headers of the occupied bricks, which bricks they are, and the box of filled voxels. One group per brick of the grid.
layout(local_size_x = 64) in;

#include "shaders/shared/voxlink.h"

layout(std430, binding = 0) readonly buffer Bricks { uvec2 bricks[]; };  // x: occupied ones before
layout(std430, binding = 1) readonly buffer Table { uvec2 table[]; };    // x: filled voxels before
layout(std430, binding = 2) writeonly buffer BrickHeaders { uint brickHeaders[]; };
layout(std430, binding = 3) writeonly buffer PlaceBricks { uint placeBricks[]; };
layout(std430, binding = 4) buffer Box { int box[6]; };  // low x y z, high x y z (exclusive)

layout(location = 0) uniform ivec3 size;  // in bricks
layout(location = 1) uniform int edge;

shared int low[3], high[3];
shared uint headerPart[161];  // headerWords(16) are the most

void main() {
  uvec3 group = gl_WorkGroupID;
  uint brick = (group.z * uint(size.y) + group.y) * uint(size.x) + group.x;
  uint rank = bricks[brick].x;
  if (bricks[brick + 1u].x == rank) return;  // the whole group
  uint local = gl_LocalInvocationIndex;
  if (local < 3u) {
    low[local] = 0x7fffffff;
    high[local] = 0;
  }
  uint first = rank * uint(edge * edge * edge);
  uint voxels = table[first].x;
  int words = headerWords(edge);
  for (int word = int(local); word < words; word += 64)
    headerPart[word] = word == 0 ? voxels : 0u;
  if (local == 0u) placeBricks[rank] = brick;
  barrier();
  for (int column = int(local); column < edge * edge; column += 64) {
    uint at = first + uint(column * edge), mask = 0u;
    for (int z = 0; z < edge; ++z)
      mask |= table[at + uint(z) + 1u].x > table[at + uint(z)].x ? 1u << z : 0u;
    int bit = column * edge;
    atomicOr(headerPart[maskWord(bit)], mask << (bit & 31));
    if (bit % 64 == 0) atomicOr(headerPart[startWord(edge, bit)], (table[at].x - voxels) << startShift(bit));
    if (mask == 0u) continue;
    ivec3 corner = ivec3(group) * edge + ivec3(column % edge, column / edge, 0);
    ivec3 from = corner + ivec3(0, 0, findLSB(mask)), to = corner + ivec3(1, 1, findMSB(mask) + 1);
    for (int axis = 0; axis < 3; ++axis) {
      atomicMin(low[axis], from[axis]);
      atomicMax(high[axis], to[axis]);
    }
  }
  barrier();
  for (int word = int(local); word < words; word += 64)
    brickHeaders[rank * uint(words) + uint(word)] = headerPart[word];
  if (local < 3u) {
    atomicMin(box[local], low[local]);
    atomicMax(box[3u + local], high[local]);
  }
}
