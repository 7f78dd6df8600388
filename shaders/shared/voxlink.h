// The VoxLink buffers, in GLSL and C++ alike (papers/voxlink section 4.1; docs/voxlink.md draws them).
//
//   brickWords      one per 32 bricks of the grid, x fastest: which are occupied, and how many are before them
//   brickHeaders    per occupied brick headerWords(edge) words: its first fragment; a bit per voxel, whether it is
//                   filled; per 64 of these bits 16 more, how many of the brick's voxels are filled before them.
//                   A list is a column of voxels along z, the predominant axis; lists follow each other x fastest
//   fragmentBuffer  one word per filled voxel, lists one after the other: a code of the value and a normal
//   materialBuffer  per code: linear colour and extinction
#ifndef FREEVOXEL_SHADERS_SHARED_VOXLINK_H
#define FREEVOXEL_SHADERS_SHARED_VOXLINK_H

#include "shaders/shared/exact_math.h"
#include "shaders/shared/language.h"

#ifdef __cplusplus
#include <cmath>
#endif

FREEVOXEL_BEGIN_SHARED

#ifdef __cplusplus
using std::cos;
using std::sin;
#endif

// 32 bricks of the grid.
struct BrickWord {
  uint occupied;  // bit i: brick 32 w + i holds a filled voxel
  uint rank;      // occupied bricks in the words before
};

// A voxel's material: linear RGB and extinction per shortest voxel edge.
struct VoxelMaterial {
  float red, green, blue, extinction;
};

// Where a ray of the image stands between two passes.
struct RayState {
  float red, green, blue;  // gathered so far, premultiplied
  float through;           // what is left of the light
  int x, y, z;             // the voxel it enters next; x = kRayDone when there is none
  float t;                 // where, in shortest voxel edges from the ray's origin
};
SHARED_CONSTANT int kRayDone = -1;

// Light that a ray no longer gathers: what is behind this share adds at most half a step of an 8-bit picture.
SHARED_CONSTANT float kOpaqueEnough = 0.000244140625f;  // 2^-12

// Directions with components smaller than this are taken as this: no division by 0.
SHARED_CONSTANT float kLeastComponent = 1e-12f;

// Words of a brick's header: one, masks, starts. Bit `column * edge + z` of the masks is a voxel's, column = y * edge +
// x.
SHARED_FUNCTION int maskWords(int edge) {
  return edge * edge * edge / 32;
}
SHARED_FUNCTION int headerWords(int edge) {
  return 1 + maskWords(edge) + (maskWords(edge) + 3) / 4;
}
// Where in a header a voxel's bit is,
SHARED_FUNCTION int maskWord(int bit) {
  return 1 + (bit >> 5);
}
// and how many voxels are filled before its 64: the word, and how far that word is to be shifted down.
SHARED_FUNCTION int startWord(int edge, int bit) {
  return 1 + maskWords(edge) + (bit >> 7);
}
SHARED_FUNCTION int startShift(int bit) {
  return (bit >> 6 & 1) * 16;
}
// The mask of a list from the word that holds it; bit z is the voxel at z.
SHARED_FUNCTION uint listMask(uint word, int edge, int column) {
  return word >> (column * edge & 31) & ((1u << edge) - 1u);
}

// A fragment: code in the lower half, normal in the upper.
SHARED_FUNCTION uint fragmentOf(uint code, uint normal) {
  return code | normal << 16;
}
SHARED_FUNCTION uint fragmentCode(uint fragment) {
  return fragment & 0xffffu;
}
SHARED_FUNCTION uint fragmentNormal(uint fragment) {
  return fragment >> 16;
}

// Normals are polar, 16 bits: 7 of the angle from z, 7 of the angle about it, and 2 of how much of a surface it is,
// 0 to 3 (base/light.h: where values hardly change there is none).
SHARED_CONSTANT float kPi = 3.14159265f;
// Of a gradient with its largest component below 2^60; `perSurface` is 1 over the square of the gradient that is all
// surface. Every backend packs alike.
SHARED_FUNCTION uint packNormal(float x, float y, float z, float perSurface) {
  float size = max(max(max(x, -x), max(y, -y)), max(z, -z));
  if (!(size > 8.7e-19f)) return 0u;  // 2^-60
  EXACT float toOne = reciprocal(size);
  EXACT float a = x * toOne;
  EXACT float b = y * toOne;
  EXACT float c = z * toOne;
  EXACT float flat_ = a * a + b * b;
  EXACT float sum = flat_ + c * c;
  EXACT float cosine = c * reciprocalRoot(sum);
  EXACT float polar = arcCosine(cosine) * (127.0f / kPi) + 0.5f;
  // At the poles there is no azimuth.
  EXACT float turn = flat_ < 1e-12f ? 0.0f : arcTangent(b, a) * (64.0f / kPi);
  EXACT float azimuth = turn < 0.0f ? turn + 128.5f : turn + 0.5f;
  // The squares of 1/6, 1/2 and 5/6 of a surface.
  EXACT float square = x * x + y * y + z * z;
  EXACT float share = square * perSurface;
  uint strength = share < 0.0277777778f ? 0u : share < 0.25f ? 1u : share < 0.694444444f ? 2u : 3u;
  return uint(polar) | (uint(azimuth) & 127u) << 7 | strength << 14;
}
SHARED_FUNCTION void unpackNormal(uint packed_, SHARED_OUT(float) x, SHARED_OUT(float) y, SHARED_OUT(float) z,
                                  SHARED_OUT(float) surface) {
  float polar = float(packed_ & 127u) * (kPi / 127.0f);
  float azimuth = float(packed_ >> 7 & 127u) * (kPi / 64.0f);
  x = sin(polar) * cos(azimuth);
  y = sin(polar) * sin(azimuth);
  z = cos(polar);
  surface = float(packed_ >> 14) * (1.0f / 3.0f);
}

// Light at a voxel in one word: three numbers of 9 bits with one exponent, 0 to 2^15.
SHARED_FUNCTION uint packLight(float red, float green, float blue) {
  float most = min(max(max(red, green), blue), 32768.0f);
  if (!(most > 0.0000305f)) return 0u;
  int exponent = max(int(floatBitsToUint(most * 1.00098f) >> 23) - 126, -15);
  float scale = uintBitsToFloat(uint(127 + 9 - exponent) << 23);
  uint r = uint(min(max(red, 0.0f) * scale + 0.5f, 511.0f));
  uint g = uint(min(max(green, 0.0f) * scale + 0.5f, 511.0f));
  uint b = uint(min(max(blue, 0.0f) * scale + 0.5f, 511.0f));
  return r | g << 9 | b << 18 | uint(exponent + 15) << 27;
}
SHARED_FUNCTION void unpackLight(uint light, SHARED_OUT(float) red, SHARED_OUT(float) green, SHARED_OUT(float) blue) {
  float scale = uintBitsToFloat(((light >> 27) + uint(127 - 9 - 15)) << 23);
  red = float(light & 511u) * scale;
  green = float(light >> 9 & 511u) * scale;
  blue = float(light >> 18 & 511u) * scale;
}

FREEVOXEL_END_SHARED

#endif
