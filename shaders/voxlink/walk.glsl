// A ray through the bricks, one step at a time: past an empty brick, or to the next filled voxel of a list, or to the
// next list (papers/voxlink section 3.1.4). Voxel (i,j,k) fills the box from (i,j,k) to (i,j,k) + 1.
#include "shaders/voxlink/brick_grid.glsl"

struct Walk {
  vec3 origin;     // voxels
  vec3 direction;  // voxels per unit of t
  vec3 inverse;
  ivec3 voxel;  // that the ray enters at t
  float t;
};

const float kFar = 1e30;

bool insideBox(Walk w, int axis) {
  return w.voxel[axis] >= boxLow[axis] && w.voxel[axis] < boxHigh[axis];
}

float planeAt(Walk w, int axis, int plane) {
  return (float(plane) - w.origin[axis]) * w.inverse[axis];
}

// The voxel along an axis at w.t, kept inside a range.
int followed(Walk w, int axis, int low, int high) {
  return clamp(int(floor(w.origin[axis] + w.t * w.direction[axis])), low, high);
}

// Puts a ray at the box, not before `start`; false if it misses it.
bool startWalk(vec3 origin, vec3 direction, float start, out Walk w) {
  w.origin = origin;
  w.t = start;
  float leave = kFar;
  for (int axis = 0; axis < 3; ++axis) {
    float d = direction[axis];
    if (abs(d) < kLeastComponent) d = d < 0.0 ? -kLeastComponent : kLeastComponent;
    w.direction[axis] = d;
    w.inverse[axis] = 1.0 / d;
    float a = planeAt(w, axis, boxLow[axis]);
    float b = planeAt(w, axis, boxHigh[axis]);
    w.t = max(w.t, min(a, b));
    leave = min(leave, max(a, b));
  }
  for (int axis = 0; axis < 3; ++axis)
    w.voxel[axis] = followed(w, axis, boxLow[axis], boxHigh[axis] - 1);
  return w.t < leave;
}

struct WalkStep {
  bool hit;       // a filled voxel was met
  uint fragment;  // then: its fragment,
  ivec3 voxel;    // its place,
  float from, to; // and the part of the ray inside
};

// One step; false when the ray has left the box.
bool walkOn(inout Walk w, out WalkStep s) {
  s.hit = false;
  s.fragment = 0u;
  s.voxel = w.voxel;
  s.from = w.t;
  s.to = w.t;
  ivec3 brick = w.voxel / edge;
  ivec3 first = brick * edge;
  uint header;
  if (!findBrick(brick, header)) {
    float nearest = kFar;
    int axis = 0;
    for (int a = 0; a < 3; ++a) {
      float exit_ = planeAt(w, a, w.direction[a] > 0.0 ? first[a] + edge : first[a]);
      if (exit_ < nearest) {
        nearest = exit_;
        axis = a;
      }
    }
    w.t = max(w.t, nearest);
    ivec3 next = w.voxel;
    for (int a = 0; a < 3; ++a) {
      if (a == axis) {
        next[a] = w.direction[a] > 0.0 ? first[a] + edge : first[a] - 1;
      } else if (w.direction[a] > 0.0) {
        next[a] = followed(w, a, w.voxel[a], first[a] + edge - 1);
      } else {
        next[a] = followed(w, a, first[a], w.voxel[a]);
      }
    }
    w.voxel = next;
    return insideBox(w, axis);
  }

  bool up = w.direction.z > 0.0;
  int column = (w.voxel.y - first.y) * edge + (w.voxel.x - first.x);
  int localZ = w.voxel.z - first.z;
  uint mask = columnMask(header, column);
  uint ahead = up ? mask >> localZ << localZ : mask & ((2u << localZ) - 1u);
  float exitX = planeAt(w, 0, w.direction.x > 0.0 ? w.voxel.x + 1 : w.voxel.x);
  float exitY = planeAt(w, 1, w.direction.y > 0.0 ? w.voxel.y + 1 : w.voxel.y);
  float exitXY = min(exitX, exitY);
  float exitZ = planeAt(w, 2, up ? first.z + edge : first.z);
  int nextZ = up ? first.z + edge : first.z - 1;
  if (ahead != 0u) {
    int bit = up ? findLSB(ahead) : findMSB(ahead);
    float enter = bit == localZ ? w.t : planeAt(w, 2, up ? first.z + bit : first.z + bit + 1);
    if (enter < exitXY) {
      exitZ = planeAt(w, 2, up ? first.z + bit + 1 : first.z + bit);
      nextZ = up ? first.z + bit + 1 : first.z + bit - 1;
      w.voxel.z = first.z + bit;
      w.t = max(w.t, enter);
      s.hit = true;
      s.fragment = storedVoxel(header, column * edge + bit);
      s.voxel = w.voxel;
      s.from = enter;
      s.to = max(enter, min(exitXY, exitZ));
    }
  }
  if (exitZ <= exitXY) {
    w.t = max(w.t, exitZ);
    w.voxel.z = nextZ;
    return insideBox(w, 2);
  }
  w.t = max(w.t, exitXY);
  w.voxel.z = up ? followed(w, 2, w.voxel.z, nextZ - 1) : followed(w, 2, nextZ + 1, w.voxel.z);
  int axis = exitX <= exitY ? 0 : 1;
  w.voxel[axis] += w.direction[axis] > 0.0 ? 1 : -1;
  return insideBox(w, axis);
}
