// One bounded number of steps of every ray of the image that is not done (papers/voxlink section 5.2.2).
layout(local_size_x = 8, local_size_y = 8) in;

#include "shaders/voxlink/walk.glsl"

layout(std430, binding = 2) readonly buffer Fragments { uint fragmentBuffer[]; };
layout(std430, binding = 3) readonly buffer Materials { VoxelMaterial materialBuffer[]; };
layout(std430, binding = 4) readonly buffer Light { uint voxelLight[]; };
layout(std430, binding = 5) buffer Rays { RayState rays[]; };
layout(std430, binding = 6) buffer Active { uint activeRays; };

layout(location = 5) uniform ivec2 imageSize;  // the rows that are traced
// Where a pixel's ray passes the plane of focus, in voxels, and the way there from the eye, in shortest voxel edges:
// of pixel (0,0), per pixel right, per pixel down.
layout(location = 6) uniform vec3 place[3];
layout(location = 9) uniform vec3 way[3];
layout(location = 12) uniform mat3 indexFromLength;
layout(location = 13) uniform int steps;
layout(location = 14) uniform int firstPass;
layout(location = 15) uniform int lit;
layout(location = 16) uniform int firstRow;

void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  if (pixel.x >= imageSize.x || pixel.y >= imageSize.y) return;
  int at = pixel.y * imageSize.x + pixel.x;
  vec2 centre = vec2(pixel.x, pixel.y + firstRow) + 0.5;
  vec3 origin = place[0] + centre.x * place[1] + centre.y * place[2];
  vec3 fromEye = way[0] + centre.x * way[1] + centre.y * way[2];
  float distance_ = length(fromEye);
  vec3 direction = indexFromLength * (fromEye / distance_);

  Walk w;
  bool alive = startWalk(origin, direction, -distance_, w);
  RayState ray = RayState(0.0, 0.0, 0.0, 1.0, kRayDone, 0, 0, 0.0);
  if (firstPass == 0) {
    ray = rays[at];
    alive = ray.x != kRayDone;
    w.voxel = ivec3(ray.x, ray.y, ray.z);
    w.t = ray.t;
  }
  if (firstPass == 0 && !alive) return;

  for (int i = 0; i < steps && alive; ++i) {
    WalkStep s;
    alive = walkOn(w, s);
    if (!s.hit) continue;
    VoxelMaterial material = materialBuffer[fragmentCode(fragmentBuffer[s.fragment])];
    float passed = exp(-material.extinction * (s.to - s.from));
    float taken = ray.through * (1.0 - passed);
    float red = 1.0, green = 1.0, blue = 1.0;
    if (lit != 0) unpackLight(voxelLight[s.fragment], red, green, blue);
    ray.red += taken * material.red * red;
    ray.green += taken * material.green * green;
    ray.blue += taken * material.blue * blue;
    ray.through *= passed;
    if (ray.through < kOpaqueEnough) alive = false;
  }
  ray.x = alive ? w.voxel.x : kRayDone;
  ray.y = w.voxel.y;
  ray.z = w.voxel.z;
  ray.t = w.t;
  rays[at] = ray;
  if (alive) atomicAdd(activeRays, 1u);
}
