// A triangle on the grid of subvoxels and the voxels it touches: voxlink/triangle_overlap.h in GLSL.
#include "shaders/shared/scene_voxel.h"

struct SnappedTriangle {
  int place[9];  // three vertices, in subvoxels
  uint axis;     // of the longest component of the normal; 3: no area
  uint key;      // kTriangles | material << 3 | face
  uint unused;
};

const int kHalf = kSubvoxels / 2;

int placeOf(SnappedTriangle t, int vertex, int axis) {
  return t.place[3 * vertex + axis];
}

// Not an array: drivers have failed to index arrays of 64-bit integers.
struct WideNormal {
  int64_t x, y, z;
};
int64_t along(WideNormal normal, int axis) {
  return axis == 0 ? normal.x : axis == 1 ? normal.y : normal.z;
}

int64_t magnitude(int64_t x) {
  return x < 0 ? -x : x;
}

int64_t normalOf(SnappedTriangle t, int axis) {
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  return int64_t(placeOf(t, 1, u) - placeOf(t, 0, u)) * int64_t(placeOf(t, 2, v) - placeOf(t, 0, v)) -
         int64_t(placeOf(t, 1, v) - placeOf(t, 0, v)) * int64_t(placeOf(t, 2, u) - placeOf(t, 0, u));
}

WideNormal normalOf(SnappedTriangle t) {
  return WideNormal(normalOf(t, 0), normalOf(t, 1), normalOf(t, 2));
}

ivec3 lowOf(SnappedTriangle t) {
  return min(ivec3(t.place[0], t.place[1], t.place[2]),
             min(ivec3(t.place[3], t.place[4], t.place[5]), ivec3(t.place[6], t.place[7], t.place[8])));
}
ivec3 highOf(SnappedTriangle t) {
  return max(ivec3(t.place[0], t.place[1], t.place[2]),
             max(ivec3(t.place[3], t.place[4], t.place[5]), ivec3(t.place[6], t.place[7], t.place[8])));
}

// First and last voxel whose closed box reaches a range of places.
ivec3 firstVoxel(ivec3 low) {
  return max(ivec3(0), (low + (kSubvoxels - 1)) / kSubvoxels - 1);
}
ivec3 lastVoxel(ivec3 high, ivec3 dims) {
  return min(high / kSubvoxels, dims - 1);
}

// The projection along an axis: the square of a voxel against the three edges.
bool touchesAlong(SnappedTriangle t, int axis, int64_t normal, ivec3 centre) {
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  int turn = normal < 0 ? -1 : 1;
  for (int i = 0; i < 3; ++i) {
    int j = i == 2 ? 0 : i + 1;
    int edgeU = -turn * (placeOf(t, j, v) - placeOf(t, i, v));
    int edgeV = turn * (placeOf(t, j, u) - placeOf(t, i, u));
    int64_t inside = int64_t(edgeU) * int64_t(centre[u] - placeOf(t, i, u)) +
                     int64_t(edgeV) * int64_t(centre[v] - placeOf(t, i, v));
    int64_t radius = int64_t(kHalf) * int64_t(abs(edgeU) + abs(edgeV));
    if (inside < -radius || (normal == 0 && inside > radius)) return false;
  }
  return true;
}

// The normal's product with the way from the first vertex to a place.
int64_t aboveOf(SnappedTriangle t, WideNormal normal, ivec3 place) {
  return normal.x * int64_t(place.x - t.place[0]) + normal.y * int64_t(place.y - t.place[1]) +
         normal.z * int64_t(place.z - t.place[2]);
}

bool touches(SnappedTriangle t, WideNormal normal, ivec3 low, ivec3 high, ivec3 voxel) {
  ivec3 centre = voxel * kSubvoxels + kHalf;
  if (any(greaterThan(centre - kHalf, high)) || any(lessThan(centre + kHalf, low))) return false;
  int64_t radius = int64_t(kHalf) * (magnitude(normal.x) + magnitude(normal.y) + magnitude(normal.z));
  return magnitude(aboveOf(t, normal, centre)) <= radius && touchesAlong(t, 0, normal.x, centre) &&
         touchesAlong(t, 1, normal.y, centre) && touchesAlong(t, 2, normal.z, centre);
}
