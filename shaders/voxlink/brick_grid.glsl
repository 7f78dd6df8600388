// Where bricks are found (voxlink/buffers.h). Bindings 0 and 1 and locations 0 to 4 of every pass over the buffers.
#include "shaders/shared/voxlink.h"

layout(std430, binding = 0) readonly buffer BrickWords { BrickWord brickWords[]; };
layout(std430, binding = 1) readonly buffer BrickHeaders { uint brickHeaders[]; };

layout(location = 0) uniform ivec3 boxLow;   // of the stored voxels
layout(location = 1) uniform ivec3 boxHigh;  // exclusive
layout(location = 2) uniform ivec3 gridFirst;
layout(location = 3) uniform ivec3 gridCount;
layout(location = 4) uniform int edge;

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
