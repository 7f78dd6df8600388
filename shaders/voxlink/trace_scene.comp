// A bounded number of steps of the rays of a pass, view rays and shadow rays (papers/voxlink section 5.2). What comes of
// them goes on the stack, light to the pixels' sums.
layout(local_size_x = 64) in;

#include "shaders/shared/scene_voxel.h"
#include "shaders/voxlink/walk.glsl"

layout(std430, binding = 2) readonly buffer Voxels { uint voxelBuffer[]; };
layout(std430, binding = 3) readonly buffer Fragments { SceneFragment fragmentBuffer[]; };
layout(std430, binding = 4) readonly buffer Materials { SurfaceMaterial materialBuffer[]; };
layout(std430, binding = 5) readonly buffer Spheres { SceneSphere sphereBuffer[]; };
layout(std430, binding = 6) readonly buffer VolumeMaterials { VoxelMaterial volumeMaterials[]; };
layout(std430, binding = 7) readonly buffer FirstOfVolume { uint firstOfVolume[]; };
layout(std430, binding = 8) readonly buffer VolumeLight { uint volumeLight[]; };
// Two vec4 per lamp: place in voxels or unit vector, and 1 if it is a direction; colour.
layout(std430, binding = 9) readonly buffer Lamps { vec4 lamps[]; };
layout(std430, binding = 10) readonly buffer Batch { RayRecord rayBatch[]; };
layout(std430, binding = 11) writeonly buffer Stack { RayRecord rayStack[]; };
layout(std430, binding = 12) buffer Control { RayControl control; };
// Four per pixel: red, green, blue, what escapes.
layout(std430, binding = 13) buffer Sums { uint sums[]; };

layout(location = 5) uniform ivec2 imageSize;  // the rows that are traced
// As in trace_rays.comp, both in voxels.
layout(location = 6) uniform vec3 place[3];
layout(location = 9) uniform vec3 way[3];
layout(location = 12) uniform int steps;
layout(location = 13) uniform int lit;  // whether volumes have light of their own
layout(location = 14) uniform int lampCount;
layout(location = 15) uniform int shadowRays;
layout(location = 16) uniform int maxDepth;
layout(location = 17) uniform float ambient;
layout(location = 18) uniform int shading;  // 0 none, 1 lambert, 2 phong
layout(location = 19) uniform float highlight;
layout(location = 20) uniform float exponent;
layout(location = 21) uniform float sumScale;
layout(location = 22) uniform float escapeScale;
layout(location = 23) uniform int firstRow;

const float kSphereSlack = 1e-3;
// Turns of all loops that an invocation may take before it has to wait for the next pass.
const int kMostWork = 12000;

// The next surface in a voxel.
struct Meeting {
  float t, leave;  // leave: where the ray is out of reach of its plane
  int fragment;    // -1: none
  uint material, plane;  // plane: 0 of a sphere
  bool leaving;
  vec3 outward, normal;
};

vec3 directionOf(RayRecord ray) {
  return vec3(ray.directionX, ray.directionY, ray.directionZ);
}
vec3 originOf(RayRecord ray) {
  return vec3(ray.originX, ray.originY, ray.originZ);
}

void consider(float t, float leave, int number, uint material, uint plane, vec3 outward, vec3 normal, WalkStep s,
              vec3 direction, float now, inout RayRecord ray, inout Meeting best) {
  bool leaving = dot(direction, outward) > 0.0;
  bool ahead = t > now || (t == now && number > ray.last);
  uint key = surfaceKey(material, leaving);
  bool same = s.from + t < ray.ignoreUntil &&
              (sameSurface(ray.ignored, key) || samePlane(ray.ignored, ray.left, key, plane, (ray.state & kShadowRay) != 0u));
  if (ahead && same) ray.ignoreUntil = max(ray.ignoreUntil, s.from + leave + kGapVoxels);
  if (ahead && !same && s.from + t < best.t)
    best = Meeting(s.from + t, s.from + leave, number, material, plane, leaving, outward, normal);
}

// The surface that a ray meets next in a voxel, after ray.last at ray.at.
Meeting nextMeeting(WalkStep s, float to, inout RayRecord ray) {
  Meeting best = Meeting(kFar, 0.0, -1, 0u, 0u, false, vec3(0.0), vec3(0.0));
  float length_ = to - s.from, now = ray.at - s.from;
  vec3 direction = directionOf(ray);
  vec3 entry = originOf(ray) + s.from * direction;
  uint first = voxelBuffer[s.fragment], end = voxelBuffer[s.fragment + 1u];
  for (uint i = first; i < end; ++i) {
    SceneFragment fragment = fragmentBuffer[i];
    int number = int(i - first);
    uint kind = fragmentKind(fragment.head);
    if (kind == kTriangles) {
      float t = 0.0, leave = 0.0;
      bool met = meetPlane(fragment.body, entry - (vec3(s.voxel) + 0.5), direction, length_, s.from - ray.start,
                           (ray.state & kThrownBack) != 0u, t, leave);
      if (met) {
        vec3 normal = unpackDirection(fragment.head);
        consider(t, leave, number, fragmentIndex(fragment.head), fragment.body, planeOutward(fragment.body, normal),
                 normal, s, direction, now, ray, best);
      }
    } else if (kind == kSphere) {
      SceneSphere sphere = sphereBuffer[sphereIndex(fragment.head)];
      vec3 from = entry - vec3(sphere.x, sphere.y, sphere.z);
      float near = 0.0, far = 0.0;
      bool met = meetSphere(sphere.radius, from, direction, near, far);
      for (int k = 0; k < 2; ++k) {
        float root = k == 0 ? near : far;
        float t = clamp(root, 0.0, length_);
        vec3 outward = (from + root * direction) / sphere.radius;
        if (met && root >= -kSphereSlack && root <= length_ + kSphereSlack)
          consider(t, t, number, sphere.material, 0u, outward, outward, s, direction, now, ray, best);
      }
    }
  }
  return best;
}

// The normal for light where a ray meets a plane: those of the surface around, blended.
vec3 blendedNormal(Meeting met, ivec3 voxel, vec3 place_, vec3 direction) {
  vec3 within = place_ - vec3(voxel);
  vec3 sum = vec3(0.0);
  for (int i = 0; i < 27; ++i) {
    ivec3 step_ = ivec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    uint stored;
    if (findVoxel(voxel + step_, stored)) {
      float weight = blendWeight(within.x, step_.x) * blendWeight(within.y, step_.y) * blendWeight(within.z, step_.z);
      uint first = voxelBuffer[stored], end = voxelBuffer[stored + 1u];
      for (uint k = first; k < end; ++k) {
        uint head = fragmentBuffer[k].head;
        vec3 normal = unpackDirection(head);
        if (fragmentKind(head) == kTriangles && fragmentIndex(head) == met.material)
          sum += weight * blendLikeness(dot(normal, met.normal)) * normal;
      }
    }
  }
  return facingNormal(sum, met.outward, direction);
}

// What the volumes in a voxel take over a length, and send.
float volumeExtinction(WalkStep s, out vec3 colour) {
  float sum = 0.0;
  colour = vec3(0.0);
  uint first = voxelBuffer[s.fragment], end = voxelBuffer[s.fragment + 1u];
  for (uint i = first; i < end; ++i) {
    SceneFragment fragment = fragmentBuffer[i];
    if (fragmentKind(fragment.head) == kVolume) {
      VoxelMaterial material =
          volumeMaterials[firstOfVolume[fragmentIndex(fragment.head)] + fragmentCode(fragment.body)];
      float red = 1.0, green = 1.0, blue = 1.0;
      if (lit != 0) unpackLight(volumeLight[i], red, green, blue);
      sum += material.extinction;
      colour += material.extinction * vec3(material.red * red, material.green * green, material.blue * blue);
    }
  }
  return sum;
}

void add(uint pixel, vec3 light) {
  for (int c = 0; c < 3; ++c) {
    uint amount = uint(light[c] * sumScale + 0.5);
    if (amount != 0u) atomicAdd(sums[4u * pixel + uint(c)], amount);
  }
}

// Whether there is room on the stack for what comes of the next surface.
bool room = true;

void push(RayRecord ray) {
  rayStack[atomicAdd(control.waiting, 1u)] = ray;
}
void pushNew(RayRecord ray) {
  push(ray);
  atomicAdd(control.born, 1u);
  room = false;
}

// A ray goes on straight behind a surface.
void pass(inout RayRecord ray, Meeting met) {
  ray.ignored = surfaceKey(met.material, met.leaving);
  ray.left = met.plane;
  ray.ignoreUntil = met.leave + kGapVoxels;
}

// A ray starts anew at a surface.
RayRecord startFrom(RayRecord ray, Meeting met, WalkStep s, vec3 direction, bool thrownBack) {
  vec3 origin = originOf(ray) + met.t * directionOf(ray);
  direction = normalize(direction);
  ray.originX = origin.x;
  ray.originY = origin.y;
  ray.originZ = origin.z;
  ray.start = 0.0;
  ray.directionX = direction.x;
  ray.directionY = direction.y;
  ray.directionZ = direction.z;
  ray.x = s.voxel.x;
  ray.y = s.voxel.y;
  ray.z = s.voxel.z;
  ray.t = 0.0;
  ray.at = 0.0;
  ray.last = -1;
  ray.ignored = surfaceKey(met.material, dot(direction, met.outward) > 0.0);
  ray.left = met.plane;
  ray.ignoreUntil = kLeaveVoxels;
  ray.state = thrownBack ? ray.state | kThrownBack : ray.state & ~kThrownBack;
  return ray;
}

float shade(vec3 normal, vec3 towardsLight, vec3 towardsEye) {
  if (shading == 0) return 1.0;
  float side = dot(normal, towardsEye) < 0.0 ? -1.0 : 1.0;
  float cosine = max(0.0, side * dot(normal, towardsLight));
  float shaded = cosine;
  if (shading == 2 && cosine > 0.0) {
    float along = max(0.0, 2.0 * cosine * side * dot(normal, towardsEye) - dot(towardsLight, towardsEye));
    if (along > 0.0) shaded += highlight * pow(along, exponent);
  }
  return shaded;
}

// Adds a surface's own light, by shadow rays if there are any.
void lightSurface(RayRecord ray, Meeting met, WalkStep s, SurfaceMaterial material) {
  float shown = ray.through * material.opacity;
  if (!(shown > 0.0)) return;
  vec3 colour = shown * vec3(material.red, material.green, material.blue);
  vec3 sum = ambient * colour;
  vec3 hit = originOf(ray) + met.t * directionOf(ray);
  for (int n = 0; n < lampCount; ++n) {
    vec4 lamp = lamps[2 * n];
    vec3 towards = lamp.xyz;
    float distance_ = kFar;
    if (lamp.w == 0.0) {
      towards -= hit;
      distance_ = length(towards);
      if (!(distance_ > 0.0)) continue;
      towards /= distance_;
    }
    vec3 brings = colour * lamps[2 * n + 1].rgb * shade(met.normal, towards, -directionOf(ray));
    if (!(max(max(brings.r, brings.g), brings.b) * sumScale >= 0.5)) continue;
    if (shadowRays == 0) {
      sum += brings;
      continue;
    }
    RayRecord shadow = startFrom(ray, met, s, towards, true);
    shadow.red = brings.r;
    shadow.green = brings.g;
    shadow.blue = brings.b;
    shadow.through = 1.0;
    shadow.end = distance_;
    shadow.state |= kShadowRay;
    pushNew(shadow);
  }
  add(ray.pixel, sum);
}

const int kGoesOn = 0;  // straight
const int kTurned = 1;  // starts anew
const int kEnded = 2;

// What becomes of a view ray at a surface.
int meet(inout RayRecord ray, Meeting met, WalkStep s) {
  SurfaceMaterial material = materialBuffer[met.material];
  lightSurface(ray, met, s, material);
  ray.through *= 1.0 - material.opacity;
  if (ray.through < kLeastThrough) return kEnded;
  vec3 direction = directionOf(ray);
  Split split = splitRay(material, met.material + 1u, ray.through, direction, met.leaving ? -met.normal : met.normal,
                         met.leaving, ray.inside, int(ray.state & kDepthBits) >= maxDepth);
  if (split.straight > 0.0 && split.mirrored > 0.0) {
    RayRecord back = startFrom(ray, met, s, split.back, true);
    back.through = split.mirrored;
    ++back.state;
    pushNew(back);
  }
  if (split.straight > 0.0) {
    ray.through = split.straight;
    ray.inside = split.inside;
    if (split.onward == direction) {
      pass(ray, met);
      return kGoesOn;
    }
    ray = startFrom(ray, met, s, split.onward, false);
  } else if (split.mirrored > 0.0) {
    ray.through = split.mirrored;
    ray = startFrom(ray, met, s, split.back, true);
  } else {
    return kEnded;
  }
  ++ray.state;
  return kTurned;
}

// Puts a walk where a ray is.
Walk walkOf(RayRecord ray) {
  Walk w;
  w.origin = originOf(ray);
  vec3 direction = directionOf(ray);
  for (int axis = 0; axis < 3; ++axis) {
    float d = direction[axis];
    if (abs(d) < kLeastComponent) d = d < 0.0 ? -kLeastComponent : kLeastComponent;
    w.direction[axis] = d;
    w.inverse[axis] = 1.0 / d;
  }
  w.voxel = ivec3(ray.x, ray.y, ray.z);
  w.t = ray.t;
  return w;
}

// The ray of a pixel that has not had one; false if it misses the box.
bool firstRay(uint at, out RayRecord ray, out bool outside) {
  uint tile = at / 64u, tiles = uint(imageSize.x + 7) / 8u;
  ivec2 pixel = ivec2(tile % tiles, tile / tiles) * 8 + ivec2(at % 8u, at / 8u % 8u);
  outside = pixel.x >= imageSize.x || pixel.y >= imageSize.y;
  vec2 centre = vec2(pixel.x, pixel.y + firstRow) + 0.5;
  vec3 origin = place[0] + centre.x * place[1] + centre.y * place[2];
  vec3 fromEye = way[0] + centre.x * way[1] + centre.y * way[2];
  float distance_ = length(fromEye);
  vec3 direction = fromEye / distance_;
  Walk w;
  bool alive = startWalk(origin, direction, -distance_, w);
  ray = RayRecord(origin.x, origin.y, origin.z, -distance_, direction.x, direction.y, direction.z, kFar, 0.0, 0.0, 0.0,
                  1.0, w.voxel.x, w.voxel.y, w.voxel.z, w.t, w.t, -1, -kFar, 0u, 0u,
                  uint(pixel.y * imageSize.x + pixel.x), 0u, 0u);
  return alive;
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= control.fromStack + control.fromPixels) return;
  RayRecord ray;
  bool alive = true;
  if (i < control.fromStack) {
    ray = rayBatch[i];
  } else {
    bool outside;
    alive = firstRay(control.firstPixel + (i - control.fromStack), ray, outside);
    if (outside) return;
    atomicAdd(control.born, 1u);
  }
  bool isShadow = (ray.state & kShadowRay) != 0u;
  bool ended = false;  // nothing comes of it any more
  bool waits = false;  // in the middle of a voxel
  Walk w = walkOf(ray);
  int work = 0;
  for (int n = 0; n < steps && alive && !ended && !waits && work < kMostWork; ++n) {
    ++work;
    WalkStep s;
    alive = walkOn(w, s);
    if (!s.hit) {
      ray.last = -1;
      ray.at = w.t;
      continue;
    }
    float to = s.to;
    if (isShadow) {
      if (s.from >= ray.end) {
        alive = false;
        continue;
      }
      to = min(to, ray.end);
    }
    if (ray.last < 0) ray.at = s.from;
    vec3 colour;
    float extinction = volumeExtinction(s, colour);
    int fragments = int(voxelBuffer[s.fragment + 1u] - voxelBuffer[s.fragment]);
    work += fragments;
    for (bool turned = false; !turned && !ended && !waits;) {
      work += 1 + fragments;
      float ignoreUntil = ray.ignoreUntil;
      Meeting met = nextMeeting(s, to, ray);
      bool found = met.fragment >= 0;
      if (found && ((!isShadow && !room) || work > kMostWork)) {
        // What comes of this meeting has no place before the next pass.
        ray.ignoreUntil = ignoreUntil;
        ray.x = s.voxel.x;
        ray.y = s.voxel.y;
        ray.z = s.voxel.z;
        ray.t = s.from;
        waits = true;
        continue;
      }
      float until = found ? met.t : to;
      if (extinction > 0.0) {
        float passed = exp(-extinction * (until - ray.at));
        if (!isShadow) add(ray.pixel, ray.through * (1.0 - passed) / extinction * colour);
        ray.through *= passed;
        ended = ray.through < kLeastThrough;
      }
      if (!found || ended) {
        turned = true;
        ray.last = -1;
        continue;
      }
      ray.at = met.t;
      ray.last = met.fragment;
      if (isShadow) {
        ray.through *= shadowKept(materialBuffer[met.material]);
        pass(ray, met);
        ended = ray.through < kLeastThrough;
        continue;
      }
      if (met.plane != 0u) {
        vec3 hit = originOf(ray) + met.t * directionOf(ray);
        met.normal = blendedNormal(met, s.voxel, hit, directionOf(ray));
        work += 27 + 27 * fragments;
      }
      int outcome = meet(ray, met, s);
      if (outcome == kEnded) ended = true;
      if (outcome == kTurned) {
        turned = true;
        alive = true;
        w = walkOf(ray);
      }
    }
  }
  if (ended) return;
  if (waits) {
    push(ray);
  } else if (alive) {
    ray.x = w.voxel.x;
    ray.y = w.voxel.y;
    ray.z = w.voxel.z;
    ray.t = w.t;
    push(ray);
  } else if (isShadow) {
    add(ray.pixel, ray.through * vec3(ray.red, ray.green, ray.blue));
  } else {
    atomicAdd(sums[4u * ray.pixel + 3u], uint(ray.through * escapeScale + 0.5));
  }
}
