// One triangle in one voxel, in small integers (voxlink/scene_buffers.cpp, Voxeliser::part).
#include "shaders/voxlink/triangle.glsl"

layout(std430, binding = 3) readonly buffer Triangles { SnappedTriangle triangles[]; };
layout(std430, binding = 4) readonly buffer Corners { uint corners[]; };
layout(std430, binding = 5) readonly buffer Normals { float normals[]; };  // of vertices
// Eight per fragment: sums of slopes, height and normal, how many, and the reach.
layout(std430, binding = 6) buffer Sums { int sums[]; };
layout(std430, binding = 7) buffer FragmentOfEntry { uint fragmentOfEntry[]; };
layout(std430, binding = 8) readonly buffer VoxelOfPlace { uint placeBricks[]; };  // brick of each occupied one

layout(location = 1) uniform ivec3 dims;
layout(location = 2) uniform int edge;
layout(location = 3) uniform int hasNormals;

struct TrianglePart {
  int slopeU, slopeV, height;
  ivec3 normal;
};

int bitsOf(int64_t x) {
  uvec2 words = unpackUint2x32(uint64_t(magnitude(x)));
  return words.y != 0u ? findMSB(words.y) + 33 : findMSB(words.x) + 1;
}
int shifted(int64_t x, int shift) {
  return shift >= 0 ? int(x >> shift) : int(x * (int64_t(1) << -shift));
}
int shiftedInt(int x, int shift) {
  return shift >= 0 ? x >> shift : x * (1 << -shift);
}
ivec3 scaledTo11Bits(ivec3 v) {
  ivec3 size = abs(v);
  int shift = findMSB(uint(max(max(size.x, size.y), size.z))) + 1 - 11;
  return ivec3(shiftedInt(v.x, shift), shiftedInt(v.y, shift), shiftedInt(v.z, shift));
}

ivec3 voxelAt(uint place) {
  uint perBrick = uint(edge * edge * edge), local = place % perBrick;
  uint brick = placeBricks[place / perBrick];
  uvec3 size = uvec3((dims + edge - 1) / edge);
  uint e = uint(edge), column = local / e;
  return ivec3(brick % size.x, brick / size.x % size.y, brick / (size.x * size.y)) * edge +
         ivec3(column % e, column / e, local % e);
}

ivec3 vertexNormal(uint vertex) {
  return ivec3(snapped(normals[3u * vertex], 0.0, 1024.0), snapped(normals[3u * vertex + 1u], 0.0, 1024.0),
               snapped(normals[3u * vertex + 2u], 0.0, 1024.0));
}

int weightOf(ivec3 a, ivec3 b, ivec3 centre, int turn, int64_t whole, int shift) {
  int64_t inside = int64_t(turn) * determinant(b.x - a.x, b.y - a.y, centre.x - a.x, centre.y - a.y);
  if (inside < 0) inside = int64_t(0);
  if (inside > whole) inside = whole;
  return shifted(inside, shift);
}

TrianglePart partOf(uint number, ivec3 voxel) {
  SnappedTriangle t = triangles[number];
  int axis = int(t.axis);
  ivec3 centre = voxel * kSubvoxels + kHalf;
  WideVector wide = normalOf(t);
  int64_t facing = along(wide, axis);
  int shift = bitsOf(facing) - 15;
  ivec3 normal = ivec3(shifted(wide.x, shift), shifted(wide.y, shift), shifted(wide.z, shift));
  ivec3 slope = turned(normal, axis);
  TrianglePart part;
  part.slopeU = slopeOf(slope.x, slope.z);
  part.slopeV = slopeOf(slope.y, slope.z);
  part.height = heightOf(shifted(-aboveOf(t, wide, centre), shift), slope.z);
  part.normal = scaledTo11Bits(normal);
  if (hasNormals == 0) return part;
  int64_t whole = magnitude(facing);
  int weightShift = max(0, bitsOf(whole) - 15);
  int turn = facing < 0 ? -1 : 1;
  ivec3 place = turned(centre, axis);
  ivec3 a = turned(vertexOf(t, 0), axis), b = turned(vertexOf(t, 1), axis), c = turned(vertexOf(t, 2), axis);
  ivec3 sum = weightOf(b, c, place, turn, whole, weightShift) * vertexNormal(corners[3u * number]) +
              weightOf(c, a, place, turn, whole, weightShift) * vertexNormal(corners[3u * number + 1u]) +
              weightOf(a, b, place, turn, whole, weightShift) * vertexNormal(corners[3u * number + 2u]);
  if (sum != ivec3(0)) part.normal = scaledTo11Bits(sum);
  return part;
}

// Mean plane of a fragment.
ivec3 meanPlane(uint fragment) {
  int many = sums[8u * fragment + 6u];
  return ivec3(quotient(sums[8u * fragment], many), quotient(sums[8u * fragment + 1u], many),
               quotient(sums[8u * fragment + 2u], many));
}
