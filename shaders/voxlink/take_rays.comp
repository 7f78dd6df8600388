// Takes the rays of a pass off the stack.
layout(local_size_x = 64) in;

#include "shaders/shared/scene_voxel.h"

layout(std430, binding = 0) readonly buffer Control { RayControl control; };
layout(std430, binding = 1) readonly buffer Stack { RayRecord rayStack[]; };
layout(std430, binding = 2) writeonly buffer Batch { RayRecord rayBatch[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < control.fromStack) rayBatch[i] = rayStack[control.waiting + i];
}
