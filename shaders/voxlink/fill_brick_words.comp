// Which bricks of the grid are occupied, 32 an invocation.
layout(local_size_x = 64) in;

#include "shaders/shared/voxlink.h"

// Of every brick of the volume: occupied ones and voxels before it; one more entry after the last.
layout(std430, binding = 0) readonly buffer Before { uvec2 before[]; };
layout(std430, binding = 1) writeonly buffer BrickWords { BrickWord brickWords[]; };

layout(location = 0) uniform ivec3 volumeBricks;
layout(location = 1) uniform ivec3 gridFirst;
layout(location = 2) uniform ivec3 gridCount;
layout(location = 3) uniform uint wordCount;

void main() {
  uint w = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
  if (w >= wordCount) return;
  uint bricks = uint(gridCount.x) * uint(gridCount.y) * uint(gridCount.z);
  BrickWord word = BrickWord(0u, 0u);
  for (uint i = 0u; i < 32u && 32u * w + i < bricks; ++i) {
    uint at = 32u * w + i;
    uvec3 size = uvec3(gridCount);
    uvec3 brick = uvec3(gridFirst) + uvec3(at % size.x, at / size.x % size.y, at / (size.x * size.y));
    uint index = (brick.z * uint(volumeBricks.y) + brick.y) * uint(volumeBricks.x) + brick.x;
    if (i == 0u) word.rank = before[index].x;
    if (before[index + 1u].x > before[index].x) word.occupied |= 1u << i;
  }
  brickWords[w] = word;
}
