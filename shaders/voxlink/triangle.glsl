// A triangle on the grid of subvoxels and the voxels it touches: voxlink/triangle_overlap.h in GLSL.
#include "shaders/shared/scene_voxel.h"

struct SnappedTriangle {
  int place[9];  // three vertices, in subvoxels
  uint axis;     // of the longest component of the normal; 3: no area
  uint key;      // kTriangles | material << 3 | face
  uint unused;
};

const int kHalf = kSubvoxels / 2;

// No index below is computed: drivers have failed on arrays and vectors that are indexed by expressions.
ivec3 vertexOf(SnappedTriangle t, int vertex) {
  return vertex == 0   ? ivec3(t.place[0], t.place[1], t.place[2])
         : vertex == 1 ? ivec3(t.place[3], t.place[4], t.place[5])
                       : ivec3(t.place[6], t.place[7], t.place[8]);
}
int along(ivec3 v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}
// The two components after an axis's, in the order x y z x, then its own.
ivec3 turned(ivec3 v, int axis) {
  return axis == 0 ? v.yzx : axis == 1 ? v.zxy : v;
}
ivec3 turnedBack(ivec3 v, int axis) {
  return axis == 0 ? v.zxy : axis == 1 ? v.yzx : v;
}

struct WideVector {
  int64_t x, y, z;
};
int64_t along(WideVector v, int axis) {
  return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

int64_t magnitude(int64_t x) {
  return x < 0 ? -x : x;
}

int64_t determinant(int a, int b, int c, int d) {
  return int64_t(a) * int64_t(d) - int64_t(b) * int64_t(c);
}

WideVector normalOf(SnappedTriangle t) {
  ivec3 first = vertexOf(t, 0), a = vertexOf(t, 1) - first, b = vertexOf(t, 2) - first;
  return WideVector(determinant(a.y, a.z, b.y, b.z), determinant(a.z, a.x, b.z, b.x),
                    determinant(a.x, a.y, b.x, b.y));
}

ivec3 lowOf(SnappedTriangle t) {
  return min(vertexOf(t, 0), min(vertexOf(t, 1), vertexOf(t, 2)));
}
ivec3 highOf(SnappedTriangle t) {
  return max(vertexOf(t, 0), max(vertexOf(t, 1), vertexOf(t, 2)));
}

// First and last voxel whose closed box reaches a range of places.
ivec3 firstVoxel(ivec3 low) {
  return max(ivec3(0), (low + (kSubvoxels - 1)) / kSubvoxels - 1);
}
ivec3 lastVoxel(ivec3 high, ivec3 dims) {
  return min(high / kSubvoxels, dims - 1);
}

// Seen along an axis: whether the square of a voxel reaches to the inner side of an edge; of a triangle that is a line
// there, whether it reaches the line.
bool touchesEdge(ivec3 from, ivec3 to, ivec3 centre, int turn, bool line) {
  int edgeU = -turn * (to.y - from.y), edgeV = turn * (to.x - from.x);
  int64_t inside = int64_t(edgeU) * int64_t(centre.x - from.x) + int64_t(edgeV) * int64_t(centre.y - from.y);
  int64_t radius = int64_t(kHalf) * int64_t(abs(edgeU) + abs(edgeV));
  return inside >= -radius && !(line && inside > radius);
}

// The projection along an axis: the square of a voxel against the three edges.
bool touchesAlong(SnappedTriangle t, int axis, int64_t normal, ivec3 centre) {
  int turn = normal < 0 ? -1 : 1;
  bool line = normal == 0;
  ivec3 place = turned(centre, axis);
  ivec3 a = turned(vertexOf(t, 0), axis), b = turned(vertexOf(t, 1), axis), c = turned(vertexOf(t, 2), axis);
  return touchesEdge(a, b, place, turn, line) && touchesEdge(b, c, place, turn, line) &&
         touchesEdge(c, a, place, turn, line);
}

// The normal's product with the way from the first vertex to a place.
int64_t aboveOf(SnappedTriangle t, WideVector normal, ivec3 place) {
  ivec3 way = place - vertexOf(t, 0);
  return normal.x * int64_t(way.x) + normal.y * int64_t(way.y) + normal.z * int64_t(way.z);
}

bool touches(SnappedTriangle t, WideVector normal, ivec3 low, ivec3 high, ivec3 voxel) {
  ivec3 centre = voxel * kSubvoxels + kHalf;
  if (any(greaterThan(centre - kHalf, high)) || any(lessThan(centre + kHalf, low))) return false;
  int64_t radius = int64_t(kHalf) * (magnitude(normal.x) + magnitude(normal.y) + magnitude(normal.z));
  return magnitude(aboveOf(t, normal, centre)) <= radius && touchesAlong(t, 0, normal.x, centre) &&
         touchesAlong(t, 1, normal.y, centre) && touchesAlong(t, 2, normal.z, centre);
}
