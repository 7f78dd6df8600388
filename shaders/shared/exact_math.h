// Functions that GLSL does not round the same way everywhere, made of operations that it does.
#ifndef FREEVOXEL_SHADERS_SHARED_EXACT_MATH_H
#define FREEVOXEL_SHADERS_SHARED_EXACT_MATH_H

#include "shaders/shared/language.h"

FREEVOXEL_BEGIN_SHARED

// 1 / x for 2^-60 < x < 2^60, to about one unit in the last place: a guess from the bits, then Newton's steps.
SHARED_FUNCTION float reciprocal(float x) {
  EXACT float r = uintBitsToFloat(0x7ef311c7u - floatBitsToUint(x));
  EXACT float e0 = 2.0f - x * r;
  EXACT float r0 = r * e0;
  EXACT float e1 = 2.0f - x * r0;
  EXACT float r1 = r0 * e1;
  EXACT float e2 = 2.0f - x * r1;
  EXACT float r2 = r1 * e2;
  return r2;
}

// 1 - 2^-x for x >= 0, relative error below 2e-7 near 0 too. From 32 on it is 1.
SHARED_FUNCTION float absorbed(float x) {
  EXACT float limited = min(x, 32.0f);
  int whole = int(limited);
  EXACT float f = limited - float(whole);
  // 1 - 2^-f = f (ln 2 - f P(f)) on [0, 1), P fitted to 2e-9.
  EXACT float p5 = -0.0000117920816f * f + 0.000150264735f;
  EXACT float p4 = p5 * f - 0.00133137323f;
  EXACT float p3 = p4 * f + 0.00961763223f;
  EXACT float p2 = p3 * f - 0.0555040578f;
  EXACT float p1 = p2 * f + 0.240226506f;
  EXACT float q = f * (0.6931471806f - p1 * f);
  EXACT float scale = uintBitsToFloat(uint(127 - whole) << 23);
  EXACT float result = (1.0f - scale) + scale * q;
  return result;
}

FREEVOXEL_END_SHARED

#endif
