// What a kernel splat gives to a pixel, in whole quanta, to be added by blending.
#include "shaders/shared/kernel_splat.h"

flat in vec2 splatCentre;
flat in vec4 splatConicAndDepth;
flat in vec4 splatEmission;

layout(location = 0) out vec4 lightSums;
layout(location = 1) out vec2 depthSums;

void main() {
  // Row 0 of the image is row 0 of the framebuffer: both backends count pixels from the same corner.
  precise float dx = gl_FragCoord.x - splatCentre.x;
  precise float dy = gl_FragCoord.y - splatCentre.y;
  precise float weight = kernelWeight(dx, dy, splatConicAndDepth.x, splatConicAndDepth.y, splatConicAndDepth.z);
  precise float depth64 = splatConicAndDepth.w * weight;
  splitDepth(depth64, depthSums.x, depthSums.y);
  precise vec4 light = splatEmission * weight;
  lightSums = vec4(roundToWhole(light.x), roundToWhole(light.y), roundToWhole(light.z), roundToWhole(light.w));
}
