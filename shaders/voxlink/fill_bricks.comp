// Writes headers and fragments of the occupied bricks of a layer.
layout(local_size_x = 64) in;

#include "shaders/voxlink/slab.glsl"

layout(std430, binding = 2) readonly buffer Before { uvec2 before[]; };
layout(std430, binding = 3) writeonly buffer BrickHeaders { uint brickHeaders[]; };
layout(std430, binding = 4) writeonly buffer Fragments { uint fragmentBuffer[]; };

layout(location = 4) uniform mat3 gradientMatrix;
layout(location = 5) uniform float perSurface;  // packNormal

shared uint filled[64];
shared uint headerPart[161];  // headerWords(16) are the most

float difference(ivec3 voxel, int axis) {
  ivec3 low = voxel, high = voxel;
  low[axis] = max(0, voxel[axis] - 1);
  high[axis] = min(dims[axis] - 1, voxel[axis] + 1);
  if (low[axis] == high[axis]) return 0.0;
  float between = high[axis] - low[axis] == 2 ? 0.5 : 1.0;
  return (float(codeAt(high)) - float(codeAt(low))) * between;
}

void main() {
  uint index = brickIndex();
  uvec2 start = before[index];
  if (before[index + 1u].x == start.x) return;  // the whole group
  uint local = gl_LocalInvocationIndex;
  ivec3 origin = brickOrigin();
  int columns = edge * edge;
  int perInvocation = (columns + 63) / 64;
  int first = int(local) * perInvocation, end = min(first + perInvocation, columns);
  uint own = 0u;
  for (int column = first; column < end; ++column)
    own += uint(bitCount(columnMask(origin, column)));
  filled[local] = own;
  barrier();
  for (uint reach = 1u; reach < 64u; reach *= 2u) {
    uint sum = local >= reach ? filled[local - reach] : 0u;
    barrier();
    filled[local] += sum;
    barrier();
  }
  uint at = filled[local] - own;
  int words = headerWords(edge);
  for (int word = int(local); word < words; word += 64)
    headerPart[word] = word == 0 ? start.y : 0u;
  barrier();
  for (int column = first; column < end; ++column) {
    uint mask = columnMask(origin, column);
    int bit = column * edge;
    atomicOr(headerPart[maskWord(bit)], mask << (bit & 31));
    if (bit % 64 == 0) atomicOr(headerPart[startWord(edge, bit)], at << startShift(bit));
    for (; mask != 0u; mask &= mask - 1u) {
      ivec3 voxel = origin + ivec3(column % edge, column / edge, findLSB(mask));
      float dx = difference(voxel, 0), dy = difference(voxel, 1), dz = difference(voxel, 2);
      precise float x = gradientMatrix[0].x * dx + gradientMatrix[1].x * dy + gradientMatrix[2].x * dz;
      precise float y = gradientMatrix[0].y * dx + gradientMatrix[1].y * dy + gradientMatrix[2].y * dz;
      precise float z = gradientMatrix[0].z * dx + gradientMatrix[1].z * dy + gradientMatrix[2].z * dz;
      uint normal = packNormal(x, y, z, perSurface);
      fragmentBuffer[start.y + at] = fragmentOf(codeAt(voxel), normal);
      ++at;
    }
  }
  barrier();
  for (int word = int(local); word < words; word += 64)
    brickHeaders[start.x * uint(words) + uint(word)] = headerPart[word];
}
