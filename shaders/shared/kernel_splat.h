// A kernel splat and what it gives to a pixel, in GLSL and C++ alike (DESIGN sections 3 and 4; papers/freevoxels
// section 5: pre-integrated footprints of blending kernels that face the viewer).
#ifndef FREEVOXEL_SHADERS_SHARED_KERNEL_SPLAT_H
#define FREEVOXEL_SHADERS_SHARED_KERNEL_SPLAT_H

#include "shaders/shared/language.h"
#include "shaders/shared/quantum.h"

FREEVOXEL_BEGIN_SHARED

// One voxel's splat, ready for any backend. Vertex attributes 0 to 2 are its three groups of four.
struct KernelSplat {
  // Bounding rectangle in pixels: centre and half sizes. Nothing outside it is touched.
  float centreX, centreY;
  float extentX, extentY;
  // v = conicXX dx^2 + conicXY dx dy + conicYY dy^2 is 0 at the centre and 1 on the rim; dx, dy in pixels.
  float conicXX, conicXY, conicYY;
  // 64 times the optical depth that weight 1 adds.
  float depth64;
  // Light that weight 1 adds, in quanta: colour times emission times attenuation, and the same with colour 1.
  float emissionR, emissionG, emissionB, emissionO;
};

// The blending kernel, integrated along the view ray: a radial bell of this radius, in voxel edges, whose area is 1.
// Its Fourier transform vanishes at the frequencies 1 and sqrt(2) of the voxel lattice, so the weights of a plane of
// voxels add up to 1 within 0.1 % everywhere (the paper's Fig. 4: neighbours' weights sum to one); standard deviation
// 0.416.
SHARED_CONSTANT float kKernelRadius = 1.6f;
SHARED_CONSTANT float kKernelC0 = 0.780113103f;
SHARED_CONSTANT float kKernelC1 = -0.0805997239f;
SHARED_CONSTANT float kKernelC2 = -0.631679282f;

// The kernel at v = (distance / radius)^2, per square voxel edge; 0 from the rim on.
SHARED_FUNCTION float kernelProfile(float v) {
  EXACT float t = max(1.0f - v, 0.0f);
  EXACT float t2 = t * t;
  EXACT float t4 = t2 * t2;
  EXACT float bell = t4 * t;
  EXACT float shape = kKernelC0 + (kKernelC1 + kKernelC2 * v) * v;
  EXACT float weight = bell * shape;
  return weight;
}

// Weight of a splat at a pixel centre that lies (dx, dy) pixels from its own.
SHARED_FUNCTION float kernelWeight(float dx, float dy, float conicXX, float conicXY, float conicYY) {
  EXACT float along = (conicXX * dx + conicXY * dy) * dx;
  EXACT float across = conicYY * dy * dy;
  EXACT float v = along + across;
  return kernelProfile(v);
}

FREEVOXEL_END_SHARED

#endif
