// The share of a lamp's light that reaches stored voxels, by a ray each: one slice of voxels of every brick at a time.
layout(local_size_x = 64) in;

#include "shaders/voxlink/walk.glsl"

layout(std430, binding = 2) readonly buffer Fragments { uint fragmentBuffer[]; };
layout(std430, binding = 3) readonly buffer Materials { VoxelMaterial materialBuffer[]; };
// A byte per lamp and fragment.
layout(std430, binding = 4) buffer Shares { uint shares[]; };

layout(location = 5) uniform int localZ;
layout(location = 6) uniform int firstColumn;
layout(location = 7) uniform uint firstShare;
layout(location = 8) uniform int directional;
layout(location = 9) uniform vec3 lamp;             // in voxels: its place, or the direction towards it
layout(location = 10) uniform mat3 lengthFromIndex;

void main() {
  ivec3 brick = gridFirst + ivec3(gl_WorkGroupID);
  uint header;
  int column = firstColumn + int(gl_LocalInvocationIndex);
  if (!findBrick(brick, header) || column >= edge * edge) return;
  if ((columnMask(header, column) >> localZ & 1u) == 0u) return;
  uint fragment = storedVoxel(header, column * edge + localZ);
  ivec3 voxel = brick * edge + ivec3(column % edge, column / edge, localZ);

  vec3 towards = directional != 0 ? lamp : lamp - vec3(voxel);
  float distance_ = length(lengthFromIndex * towards);
  float end = directional != 0 ? kFar : distance_;
  float through = 1.0;
  if (distance_ > 0.0) {
    Walk w;
    bool alive = startWalk(vec3(voxel) + 0.5, towards / distance_, 0.0, w);
    while (alive) {
      WalkStep s;
      alive = walkOn(w, s) && s.from < end;
      if (!s.hit || s.from >= end || s.voxel == voxel) continue;
      float extinction = materialBuffer[fragmentCode(fragmentBuffer[s.fragment])].extinction;
      through *= exp(-extinction * (min(s.to, end) - s.from));
      if (through < kOpaqueEnough) alive = false;
    }
  }
  uint share = firstShare + fragment;
  atomicOr(shares[share >> 2], uint(clamp(through, 0.0, 1.0) * 255.0 + 0.5) << (8u * (share & 3u)));
}
