// Counts the filled voxels of every brick of a layer, and fits a box to them.
layout(local_size_x = 64) in;

#include "shaders/voxlink/slab.glsl"

// 1 if occupied, and filled voxels; one more entry of zeros after the last brick.
layout(std430, binding = 2) writeonly buffer Counts { uvec2 counts[]; };
layout(std430, binding = 3) buffer Box { int box[6]; };  // low x y z, high x y z (exclusive)

shared uint filled;
shared int low[3], high[3];

void main() {
  uint local = gl_LocalInvocationIndex;
  if (local == 0u) filled = 0u;
  if (local < 3u) {
    low[local] = 0x7fffffff;
    high[local] = 0;
  }
  barrier();
  ivec3 origin = brickOrigin();
  for (int column = int(local); column < edge * edge; column += 64) {
    uint mask = columnMask(origin, column);
    if (mask == 0u) continue;
    atomicAdd(filled, uint(bitCount(mask)));
    ivec3 from = origin + ivec3(column % edge, column / edge, findLSB(mask));
    ivec3 to = origin + ivec3(column % edge, column / edge, findMSB(mask)) + 1;
    for (int axis = 0; axis < 3; ++axis) {
      atomicMin(low[axis], from[axis]);
      atomicMax(high[axis], to[axis]);
    }
  }
  barrier();
  if (local == 0u) counts[brickIndex()] = uvec2(filled > 0u ? 1u : 0u, filled);
  if (local < 3u && filled > 0u) {
    atomicMin(box[local], low[local]);
    atomicMax(box[3u + local], high[local]);
  }
}
