// The light that every stored voxel sends to the eye: ambient, and of every lamp what reaches it times its shading
// (voxlink/light_voxels.h). One group per brick of the grid.
layout(local_size_x = 64) in;

#include "shaders/voxlink/brick_grid.glsl"

layout(std430, binding = 2) readonly buffer Fragments { uint fragmentBuffer[]; };
layout(std430, binding = 3) readonly buffer Shares { uint shares[]; };
layout(std430, binding = 4) writeonly buffer Light { uint voxelLight[]; };
// Two vec4 per lamp: place or direction, in shortest voxel edges and world axes, and 1 if it is a direction; colour.
layout(std430, binding = 5) readonly buffer Lamps { vec4 lamps[]; };

layout(location = 5) uniform int lampCount;
layout(location = 6) uniform uint fragmentCount;
layout(location = 7) uniform mat3 lengthFromIndex;
layout(location = 8) uniform vec4 eye;   // like a lamp's place
layout(location = 9) uniform float ambient;
layout(location = 10) uniform int shading;  // 0 none, 1 lambert, 2 phong
layout(location = 11) uniform float highlight;
layout(location = 12) uniform float exponent;

float shade(vec3 normal, float surface, vec3 towardsLight, vec3 towardsEye) {
  if (shading == 0 || surface == 0.0) return 1.0;
  if (dot(normal, towardsEye) < 0.0) normal = -normal;
  float cosine = max(0.0, dot(normal, towardsLight));
  float shaded = cosine;
  if (shading == 2 && cosine > 0.0) {
    vec3 mirrored = 2.0 * cosine * normal - towardsLight;
    float along = max(0.0, dot(mirrored, towardsEye));
    if (along > 0.0) shaded += highlight * pow(along, exponent);
  }
  return 1.0 + min(surface, 1.0) * (shaded - 1.0);
}

void main() {
  ivec3 brick = gridFirst + ivec3(gl_WorkGroupID);
  uint header;
  if (!findBrick(brick, header)) return;
  for (int column = int(gl_LocalInvocationIndex); column < edge * edge; column += 64) {
    uint fragment = storedVoxel(header, column * edge);
    for (uint mask = columnMask(header, column); mask != 0u; mask &= mask - 1u) {
      vec3 place = lengthFromIndex * vec3(brick * edge + ivec3(column % edge, column / edge, findLSB(mask)));
      vec3 normal;
      float surface;
      unpackNormal(fragmentNormal(fragmentBuffer[fragment]), normal.x, normal.y, normal.z, surface);
      vec3 toEye = eye.w != 0.0 ? eye.xyz : eye.xyz - place;
      float eyeDistance = length(toEye);
      vec3 sum = vec3(ambient);
      for (int n = 0; n < lampCount; ++n) {
        uint at = uint(n) * fragmentCount + fragment;
        float share = float(shares[at >> 2] >> (8u * (at & 3u)) & 255u) * (1.0 / 255.0);
        vec4 lamp = lamps[2 * n];
        vec3 toLight = lamp.w != 0.0 ? lamp.xyz : lamp.xyz - place;
        float lightDistance = length(toLight);
        if (lightDistance > 0.0 && eyeDistance > 0.0)
          share *= shade(normal, surface, toLight / lightDistance, toEye / eyeDistance);
        sum += lamps[2 * n + 1].rgb * share;
      }
      voxelLight[fragment] = packLight(sum.r, sum.g, sum.b);
      ++fragment;
    }
  }
}
