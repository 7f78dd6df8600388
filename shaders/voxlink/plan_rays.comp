// Decides which rays the next pass traces. A pass may add at most half of what the stack has left; where little is left,
// one ray at a time from the top: nothing can be lost, whatever the size of the stack.
layout(local_size_x = 1) in;

#include "shaders/shared/scene_voxel.h"

layout(std430, binding = 0) buffer Control { RayControl control; };

layout(location = 0) uniform uint capacity;   // of the stack
layout(location = 1) uniform uint largest;    // rays of a pass
layout(location = 2) uniform uint newPerRay;  // that a ray may add in one pass, at most
layout(location = 3) uniform uint reserve;    // what one ray after the other needs, with all that comes of it
layout(location = 4) uniform uint pixels;

void main() {
  uint rays = control.rays + control.born;
  if (rays < control.rays) ++control.raysHigh;
  control.rays = rays;
  control.born = 0u;
  uint left = capacity - control.waiting;
  uint half_ = left / 2u;
  control.fromPixels = 0u;
  if (left < 2u * reserve) {
    control.fromStack = min(control.waiting, 1u);
  } else {
    control.fromStack = min(min(control.waiting, largest), half_ / newPerRay);
    uint more = (half_ - control.fromStack * newPerRay) / (newPerRay + 1u);
    control.fromPixels = min(min(pixels - control.nextPixel, largest - control.fromStack), more);
  }
  control.firstPixel = control.nextPixel;
  control.nextPixel += control.fromPixels;
  control.waiting -= control.fromStack;
  control.copyGroups = (control.fromStack + kRayGroup - 1u) / kRayGroup;
  control.copyY = control.copyZ = 1u;
  uint all_ = control.fromStack + control.fromPixels;
  control.traceGroups = (all_ + kRayGroup - 1u) / kRayGroup;
  control.traceY = control.traceZ = 1u;
  if (all_ > 0u) ++control.passes;
}
