// Surfaces and volumes in voxels, in GLSL and C++ alike (papers/voxlink sections 4.1 and 5.2; docs/voxlink.md draws the
// buffers).
//
//   brickWords, brickHeaders   as in shaders/shared/voxlink.h; a list's start counts voxels
//   voxelBuffer     one word per filled voxel: its first fragment; one more after the last voxel
//   fragmentBuffer  two words each (SceneFragment), those of a voxel in ascending order of their keys
//   materialBuffer  SurfaceMaterial
//   sphereBuffer    SceneSphere, in voxels
#ifndef FREEVOXEL_SHADERS_SHARED_SCENE_VOXEL_H
#define FREEVOXEL_SHADERS_SHARED_SCENE_VOXEL_H

#include "shaders/shared/language.h"

#ifdef __cplusplus
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#endif

FREEVOXEL_BEGIN_SHARED

#ifdef __cplusplus
using glm::dot;
using glm::vec3;
using std::floor;
using std::sqrt;
#endif

// What a ray may meet in a voxel.
//   triangles  head: kTriangles | material << 16 | normal for shading;  body: the plane (planeOf)
//   sphere     head: kSphere | index into sphereBuffer;                 body: 0
//   volume     head: kVolume | volume << 16;                            body: code | normal << 16, as fragmentOf
struct SceneFragment {
  uint head, body;
};
SHARED_CONSTANT uint kTriangles = 0u;
SHARED_CONSTANT uint kSphere = 1u << 30;
SHARED_CONSTANT uint kVolume = 2u << 30;
SHARED_CONSTANT uint kKindBits = 3u << 30;
// Materials of a scene, its volumes: 14 bits name them.
SHARED_CONSTANT uint kMostSceneMaterials = 16384u;
SHARED_CONSTANT uint kMostSceneSpheres = 1u << 30;

SHARED_FUNCTION uint fragmentKind(uint head) {
  return head & kKindBits;
}
SHARED_FUNCTION uint fragmentIndex(uint head) {
  return head >> 16 & 0x3fffu;
}
SHARED_FUNCTION uint sphereIndex(uint head) {
  return head & ~kKindBits;
}

SHARED_CONSTANT uint kDiffuse = 0u;
SHARED_CONSTANT uint kMirror = 1u;
SHARED_CONSTANT uint kGlass = 2u;
struct SurfaceMaterial {
  float red, green, blue;  // linear
  float opacity;
  float reflectance;
  float indexOfRefraction;
  uint kind;
  uint unused;
};

// Centre and radius in voxels; voxel (i,j,k) fills the box from (i,j,k) to (i,j,k) + 1.
struct SceneSphere {
  float x, y, z, radius;
  uint material;
};

// ---- voxelisation, in integers (docs/voxlink.md, the rule) ----

// Vertices are snapped to multiples of 1/256 voxel.
SHARED_CONSTANT int kSubvoxels = 256;

// `scale`: subvoxels per world length. Only + - * and floor: the same everywhere.
SHARED_FUNCTION int snapped(float position, float origin, float scale) {
  EXACT float from = position - origin;
  EXACT float scaled = from * scale;
  EXACT float moved = scaled + 0.5f;
  return int(floor(moved));
}

// a / b rounded towards zero, b > 0 (GLSL leaves open how negative numbers are divided).
SHARED_FUNCTION int quotient(int a, int b) {
  return a < 0 ? -int(uint(-a) / uint(b)) : int(uint(a) / uint(b));
}

// The six ways a triangle may face: along its longest normal component, x y z, then the same backwards.
SHARED_FUNCTION uint faceAxis(uint face) {
  return face % 3u;
}

// The triangles of one material that face the same way in one voxel become one plane, as a height over the two other
// axes (the next ones in the order x y z x), counted from the voxel's centre:
//   height(u, v) = height + u slopeU + v slopeV,   |slope| <= 1,   give or take `reach`.
// The reach covers every one of the triangles, and what packing loses, so no ray slips through.
// Slopes in units of 1/4096, height and reach in 1/4096 voxel.
SHARED_CONSTANT int kSlopeOne = 4096;
SHARED_CONSTANT int kHeightOne = 4096;
// Packed: face 3 bits, slopes 8 and 8, height 8, reach 5.
SHARED_CONSTANT int kPackedSlope = 32;   // a step of slopes: 1/128
SHARED_CONSTANT int kPackedHeight = 52;  // a step of height: |height| <= 1.5 voxels is at most 118 of 127 steps
SHARED_CONSTANT int kPackedReach = 256;  // a step of reach: 1/16 voxel; 31 steps stand for the whole voxel

// The plane of one triangle in one voxel. `along`, `across`: components of the triangle's normal, shifted such that
// `along`, of its axis, has 15 bits; `above`: the normal's product with the way from the voxel's centre to the
// triangle, in subvoxels, shifted alike.
SHARED_FUNCTION int slopeOf(int across, int along) {
  return along < 0 ? quotient(across * kSlopeOne, -along) : quotient(-across * kSlopeOne, along);
}
SHARED_FUNCTION int heightOf(int above, int along) {
  int scale = kHeightOne / kSubvoxels;
  return along < 0 ? quotient(-above * scale, -along) : quotient(above * scale, along);
}
// How far two planes of one face are apart within a voxel, at most.
SHARED_FUNCTION int planesApart(int slopeU, int slopeV, int height, int otherU, int otherV, int otherHeight) {
  int u = slopeU - otherU, v = slopeV - otherV, h = height - otherHeight;
  return (h < 0 ? -h : h) + ((u < 0 ? -u : u) + (v < 0 ? -v : v) + 1) / 2;
}

SHARED_FUNCTION int packedSteps(int value, int step_, int most) {
  int steps = value < 0 ? quotient(value - step_ / 2, step_) : quotient(value + step_ / 2, step_);
  return steps < -most ? -most : steps > most ? most : steps;
}
SHARED_FUNCTION uint planeOf(uint face, int slopeU, int slopeV, int height, int reach) {
  int u = packedSteps(slopeU, kPackedSlope, 127), v = packedSteps(slopeV, kPackedSlope, 127);
  int h = packedSteps(height, kPackedHeight, 127);
  int lostU = u * kPackedSlope - slopeU, lostV = v * kPackedSlope - slopeV, lostH = h * kPackedHeight - height;
  int lost = (lostH < 0 ? -lostH : lostH) + ((lostU < 0 ? -lostU : lostU) + (lostV < 0 ? -lostV : lostV)) / 2 + 4;
  // 4 more for what slopeOf and heightOf cut off.
  int r = quotient(reach + lost + kPackedReach - 1, kPackedReach);
  return face | uint(u + 128) << 3 | uint(v + 128) << 11 | uint(h + 128) << 19 | uint(r > 31 ? 31 : r) << 27;
}
SHARED_FUNCTION uint planeFace(uint plane) {
  return plane & 7u;
}
SHARED_FUNCTION float planeSlopeU(uint plane) {
  return float(int(plane >> 3 & 255u) - 128) * (float(kPackedSlope) / float(kSlopeOne));
}
SHARED_FUNCTION float planeSlopeV(uint plane) {
  return float(int(plane >> 11 & 255u) - 128) * (float(kPackedSlope) / float(kSlopeOne));
}
SHARED_FUNCTION float planeHeight(uint plane) {
  return float(int(plane >> 19 & 255u) - 128) * (float(kPackedHeight) / float(kHeightOne));
}
SHARED_FUNCTION float planeReach(uint plane) {
  // Height over every point of the voxel is at most 2.5 off: the longest reach is the whole voxel.
  return plane >> 27 == 31u ? 4.0f : float(plane >> 27) * (float(kPackedReach) / float(kHeightOne));
}
// Unit normal of a plane, to the outside.
SHARED_FUNCTION vec3 planeNormal(uint plane) {
  float u = -planeSlopeU(plane), v = -planeSlopeV(plane);
  float scale = 1.0f / sqrt(1.0f + u * u + v * v);
  uint axis = faceAxis(planeFace(plane));
  if (planeFace(plane) >= 3u) scale = -scale;
  vec3 normal = axis == 0u ? vec3(1.0f, u, v) : axis == 1u ? vec3(v, 1.0f, u) : vec3(u, v, 1.0f);
  return normal * scale;
}
// The side of a plane that is outside. Scanned meshes have triangles that are turned over: the normal for light, a mean
// of the neighbours' where the mesh is smooth, knows better.
SHARED_FUNCTION vec3 planeOutward(uint plane, vec3 normal) {
  vec3 own = planeNormal(plane);
  return dot(own, normal) < 0.0f ? -own : own;
}

// ---- normals: polar, 16 bits, 8 of the angle from z and 8 of the angle about it ----
// (shaders/shared/direction_code.h packs them.)
SHARED_FUNCTION uint packedDirection(uint polar, uint azimuth) {
  return polar | azimuth << 8;
}
SHARED_FUNCTION vec3 unpackDirection(uint packed_) {
  const float pi = 3.14159265f;
  float polar = float(packed_ & 255u) * (pi / 255.0f);
  float azimuth = float(packed_ >> 8 & 255u) * (pi / 128.0f);
#ifdef __cplusplus
  using std::cos;
  using std::sin;
#endif
  return vec3(sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar));
}

// ---- rays ----

// A ray on its way.
struct RayRecord {
  float originX, originY, originZ;           // voxels
  float start;                               // where it begins, in voxels from there
  float directionX, directionY, directionZ;  // unit vector
  float end;                                 // shadow ray: the lamp
  float red, green, blue;                    // shadow ray: the light it brings to its pixel
  float through;                             // 1 - opacity of what it passed
  int x, y, z;                               // the voxel it is in,
  float t;                                   // where it entered it,
  float at;                                  // and where it is in it;
  int last;                                  // fragment of the voxel met there, counted from its first; -1: none
  float ignoreUntil;                         // surfaces like `ignored` are not met before
  uint ignored;                              // surfaceKey of the surface it leaves
  uint inside;                               // material of the glass it is in + 1; 0: none
  uint pixel;                                // y * width + x
  uint state;                                // depth, kShadowRay, kThrownBack
  uint left;                                 // plane of the surface it leaves; 0: none, or a sphere
};
SHARED_CONSTANT uint kShadowRay = 1u << 31;
// The ray started at a surface that it did not go through.
SHARED_CONSTANT uint kThrownBack = 1u << 30;
SHARED_CONSTANT uint kDepthBits = 0xffu;

// What a pass over rays is about to do, and has done. Rays that wait lie on a stack; a pass takes rays from its top,
// and pixels that have not had theirs, as many as leave room for all that may come of them.
struct RayControl {
  uint waiting;                      // on the stack
  uint nextPixel;                    // in tiles of 8 x 8
  uint fromStack;                    // of this pass
  uint fromPixels;                   // of this pass
  uint firstPixel;                   // of this pass
  uint born;                         // rays, during this pass
  uint rays, raysHigh;               // before it: 2^32 raysHigh + rays
  uint copyGroups, copyY, copyZ;     // of the pass that takes rays off the stack
  uint traceGroups, traceY, traceZ;  // of the pass that traces
  uint passes;
  uint unused;
};
// Rays per group of a pass.
SHARED_CONSTANT uint kRayGroup = 64u;

// A surface as rays know it again: its material, and the side from which it is met.
SHARED_FUNCTION uint surfaceKey(uint material, bool leaving) {
  return material << 2 | (leaving ? 2u : 1u);
}
// Whether a ray that leaves a surface may take this one for the same: the very same, or, where it leads outwards, any
// that it would leave too (materials meet within a voxel).
SHARED_FUNCTION bool sameSurface(uint ignored, uint key) {
  return ignored == key || (ignored & key & 2u) != 0u;
}
// The same of planes of one material, whichever side is met: they are one surface if they face alike. Rays that graze a
// surface meet its other voxels' planes, a little off, from either side. And meshes have triangles that are turned
// over: outside of things, and on their way to a lamp, rays take planes that face the other way for the same surface,
// too; inside they may not, or they would miss the other side of a pane of glass.
SHARED_CONSTANT float kFacesAlike = 0.5f;
SHARED_FUNCTION bool samePlane(uint ignored, uint left, uint key, uint plane, bool towardsLamp) {
  if (left == 0u || plane == 0u || ignored >> 2 != key >> 2) return false;
  float alike = dot(planeNormal(left), planeNormal(plane));
  bool eitherWay = towardsLamp || (ignored & 2u) != 0u;
  return (eitherWay && alike < 0.0f ? -alike : alike) > kFacesAlike;
}
// A ray that leaves a surface does not meet it again within so many voxels, on the same side: the surface goes on in
// neighbouring voxels, a little off.
SHARED_CONSTANT float kLeaveVoxels = 1.5f;
// A ray that is thrown back by a surface starts on the other side of a wall thinner than this, too.
SHARED_CONSTANT float kThinWall = 0.03125f;
// And goes on not meeting it as long as gaps are no longer than this.
SHARED_CONSTANT float kGapVoxels = 0.5f;
// Light that a ray no longer carries: less than half a step of an 8-bit picture.
SHARED_CONSTANT float kLeastThrough = 0.000244140625f;  // 2^-12
// A split that gives one ray less than this gives the other everything.
SHARED_CONSTANT float kLeastSplit = 0.001f;

// Where a ray meets the plane of a voxel. `at`: a point of the ray from the voxel's centre, where t is 0; it is in the
// voxel until `length_`. `begun`: how long it has been on its way there; a plane that it started from or beyond is not
// met, `thrownBack` one that it started near. False if it passes beyond the plane's reach.
SHARED_FUNCTION bool meetPlane(uint plane, vec3 at, vec3 direction, float length_, float begun, bool thrownBack,
                               SHARED_OUT(float) t, SHARED_OUT(float) leave) {
  uint axis = faceAxis(planeFace(plane));
  vec3 p = axis == 0u ? vec3(at.y, at.z, at.x) : axis == 1u ? vec3(at.z, at.x, at.y) : at;
  vec3 d = axis == 0u   ? vec3(direction.y, direction.z, direction.x)
           : axis == 1u ? vec3(direction.z, direction.x, direction.y)
                        : direction;
  float u = planeSlopeU(plane), v = planeSlopeV(plane), reach = planeReach(plane);
  float above = p.z - (planeHeight(plane) + p.x * u + p.y * v);
  float climb = d.z - (d.x * u + d.y * v);
  t = 0.0f;
  leave = length_;
  float steep = climb < 0.0f ? -climb : climb;
  if (steep < 1e-6f) return (above < 0.0f ? -above : above) <= reach;
  float cross_ = -above / climb, wide = reach / steep;
  float enter = max(cross_ - wide, 0.0f);
  leave = min(cross_ + wide, length_);
  if (enter > leave || cross_ < -begun) return false;
  if (thrownBack && (cross_ + begun) * steep < kThinWall) return false;
  t = min(max(cross_, enter), leave);
  return true;
}

// The normal for light where a ray meets a plane is blended from those of the 27 voxels round it: a quadratic B-spline
// of where in its voxel the place is (`inVoxel`, 0 to 1; `step_` to the other voxel, -1 to 1),
SHARED_FUNCTION float blendWeight(float inVoxel, int step_) {
  float x = inVoxel < 0.0f ? 0.0f : inVoxel > 1.0f ? 1.0f : inVoxel;
  if (step_ < 0) return 0.5f * (1.0f - x) * (1.0f - x);
  return step_ > 0 ? 0.5f * x * x : 0.5f + x * (1.0f - x);
}
// times how alike the normals are: all up to 53 degrees, none from 78 on, so that edges stay sharp. Negative for those
// that face the other way.
SHARED_FUNCTION float blendLikeness(float cosine) {
  float x = ((cosine < 0.0f ? -cosine : cosine) - 0.2f) * 2.5f;
  x = x < 0.0f ? 0.0f : x > 1.0f ? 1.0f : x;
  return cosine < 0.0f ? -x : x;
}
// A normal for light on the same side as the surface's own as seen along a ray: one that is turned away, or nearly, is
// bent until it is not.
SHARED_CONSTANT float kLeastFacing = 0.02f;
SHARED_FUNCTION vec3 facingNormal(vec3 normal, vec3 outward, vec3 direction) {
  float side = dot(outward, direction) < 0.0f ? -1.0f : 1.0f;
  float along = side * dot(normal, direction);
  if (along < kLeastFacing) normal = normal + ((kLeastFacing - along) * side) * direction;
  return normal * (1.0f / sqrt(dot(normal, normal)));
}

// The two places where a ray meets a sphere; `at` from the sphere's centre. False if it misses.
SHARED_FUNCTION bool meetSphere(float radius, vec3 at, vec3 direction, SHARED_OUT(float) first,
                                SHARED_OUT(float) second) {
  float along = -dot(at, direction);
  vec3 nearest = at + along * direction;
  float distance2 = dot(nearest, nearest);
  float half_ = radius * radius - distance2;
  first = along;
  second = along;
  if (half_ < 0.0f) return false;
  half_ = sqrt(half_);
  first = along - half_;
  second = along + half_;
  return true;
}

SHARED_FUNCTION vec3 reflected(vec3 direction, vec3 normal) {
  return direction - (2.0f * dot(direction, normal)) * normal;
}
// Snell's law. `normal` against the direction; `ratio`: index of refraction where the ray comes from over that where it
// goes. False if all is reflected.
SHARED_FUNCTION bool refracted(vec3 direction, vec3 normal, float ratio, SHARED_OUT(vec3) bent) {
  float cosine = -dot(direction, normal);
  float inner = 1.0f - ratio * ratio * (1.0f - cosine * cosine);
  bent = direction;
  if (inner < 0.0f) return false;
  bent = ratio * direction + (ratio * cosine - sqrt(inner)) * normal;
  bent = bent * (1.0f / sqrt(dot(bent, bent)));
  return true;
}

// What a ray does at a surface once it has its colour (papers/voxlink section 5.2.1): `through` is what is left behind
// the surface, 1 - alpha'; the shares of both rays add up to it.
struct Split {
  float straight;  // goes on, the way it came or refracted
  float mirrored;  // is reflected
  vec3 onward;     // direction of the ray that goes on
  vec3 back;       // direction of the reflected one
  uint inside;     // of the ray that goes on
};
// `normal` against the direction. `leaving`: the surface is met from inside. A ray that may not be bent any more
// (`exhausted`) goes straight on through glass, and ends at a mirror.
SHARED_FUNCTION Split splitRay(SurfaceMaterial material, uint key, float through, vec3 direction, vec3 normal,
                               bool leaving, uint inside, bool exhausted) {
  Split split;
  split.straight = through;
  split.mirrored = 0.0f;
  split.onward = direction;
  split.back = reflected(direction, normal);
  split.inside = inside;
  if (material.kind == kMirror) {
    split.straight = 0.0f;
    split.mirrored = exhausted ? 0.0f : through;
  } else if (material.kind == kGlass) {
    bool was = inside == key;
    float ratio = leaving ? (was ? material.indexOfRefraction : 1.0f) : 1.0f / material.indexOfRefraction;
    split.inside = leaving ? (was ? 0u : inside) : key;
    if (exhausted) return split;
    bool passes = refracted(direction, normal, ratio, split.onward);
    split.mirrored = passes ? through * material.reflectance : through;
    split.straight = through - split.mirrored;
    if (passes && split.mirrored < kLeastSplit) {
      split.straight = through;
      split.mirrored = 0.0f;
    } else if (split.straight < kLeastSplit) {
      split.straight = 0.0f;
      split.mirrored = through;
    }
  }
  return split;
}
// What a shadow ray keeps at a surface, straight through.
SHARED_FUNCTION float shadowKept(SurfaceMaterial material) {
  if (material.kind == kMirror) return 0.0f;
  float kept = 1.0f - material.opacity;
  return material.kind == kGlass ? kept * (1.0f - material.reflectance) : kept;
}

FREEVOXEL_END_SHARED

#endif
