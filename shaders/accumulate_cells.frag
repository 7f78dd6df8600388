// What one block gives to one pixel, in whole quanta, to be added by blending.
#include "shaders/shared/cell_segment.h"
#include "shaders/shared/quantum.h"

layout(std430, binding = 0) readonly buffer Rays { PixelRay rays[]; };
// Three layouts per block, by dominant axis.
layout(std430, binding = 1) readonly buffer Layouts { CellLayout layouts[]; };
// Code in the lower half, attenuation in the upper.
layout(std430, binding = 2) readonly buffer Samples { uint samples[]; };
layout(std430, binding = 3) readonly buffer Lights { uvec2 lights[]; };
layout(std430, binding = 4) readonly buffer Integral { vec4 integral[]; };
layout(std430, binding = 5) readonly buffer Density { vec4 density[]; };
// Of blocks of levels from 1 on.
layout(std430, binding = 6) readonly buffer Cover { CoverValue cover[]; };

layout(location = 1) uniform int imageWidth;
layout(location = 2) uniform float entriesPerCode;
layout(location = 3) uniform float inverseQuantum;
layout(location = 4) uniform float hiddenBelow;

flat in int block;

layout(location = 0) out vec4 lightSums;
layout(location = 1) out vec2 depthSums;

const float kPerUnit = 1.0 / 65535.0;

// Where the arrays of the block at hand start.
struct BlockStart {
  int samples, matter;
};

float blockPlace(BlockStart start, int voxel) {
  precise float place = float(samples[start.samples + voxel] & 0xffffu) * entriesPerCode;
  return place;
}
float blockAttenuation(BlockStart start, int voxel) {
  precise float attenuation = float(samples[start.samples + voxel] >> 16) * kPerUnit;
  return attenuation;
}
void blockLight(BlockStart start, int voxel, out float red, out float green, out float blue) {
  uvec2 light = lights[start.samples + voxel];
  precise vec3 value = vec3(float(light.x & 0xffffu), float(light.x >> 16), float(light.y & 0xffffu)) * kPerUnit;
  red = value.x;
  green = value.y;
  blue = value.z;
}
CoverValue blockCover(BlockStart start, int voxel) { return cover[start.matter + voxel]; }
TableValue tableIntegral(BlockStart start, int entry) {
  vec4 e = integral[entry];
  return TableValue(e.x, e.y, e.z, e.w);
}
TableValue tableDensity(BlockStart start, int entry) {
  vec4 e = density[entry];
  return TableValue(e.x, e.y, e.z, e.w);
}

#define BLOCK_ACCESS BlockStart start_,
#define BLOCK_HAND_ON start_,
#include "shaders/shared/cell_block.h"

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  PixelRay ray = rays[pixel.y * imageWidth + pixel.x];
  lightSums = vec4(0.0);
  depthSums = vec2(0.0);
  if (!(ray.sLow < ray.sHigh)) return;
  CellLayout layout_ = layouts[block * 3 + int(ray.axisAndSide & kRayAxisMask)];
  RaySums sums = traceBlock(BlockStart(layout_.samples, layout_.matter), ray, layout_, hiddenBelow);
  precise float red = sums.red * inverseQuantum;
  precise float green = sums.green * inverseQuantum;
  precise float blue = sums.blue * inverseQuantum;
  precise float emission = sums.emission * inverseQuantum;
  lightSums = vec4(roundToWhole(red), roundToWhole(green), roundToWhole(blue), roundToWhole(emission));
  precise float depth64 = sums.depth * kDepth64FromLog2;
  splitDepth(depth64, depthSums.x, depthSums.y);
}
