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

// 1 / sqrt(x) for 2^-100 < x < 2^100, to about two units in the last place.
SHARED_FUNCTION float reciprocalRoot(float x) {
  EXACT float r = uintBitsToFloat(0x5f3759dfu - (floatBitsToUint(x) >> 1));
  EXACT float half_ = 0.5f * x;
  EXACT float e0 = 1.5f - half_ * r * r;
  EXACT float r0 = r * e0;
  EXACT float e1 = 1.5f - half_ * r0 * r0;
  EXACT float r1 = r0 * e1;
  EXACT float e2 = 1.5f - half_ * r1 * r1;
  EXACT float r2 = r1 * e2;
  return r2;
}

// Angles in radians, errors below 2e-6 (polynomials: Abramowitz and Stegun, 4.4.46 and 4.4.49).
SHARED_FUNCTION float arcCosine(float x) {
  EXACT float size = min(x < 0.0f ? -x : x, 1.0f);
  EXACT float rest = 1.0f - size;
  if (rest < 1e-7f) return x < 0.0f ? 3.14159265f : 0.0f;
  EXACT float p6 = -0.0012624911f * size + 0.0066700901f;
  EXACT float p5 = p6 * size - 0.0170881256f;
  EXACT float p4 = p5 * size + 0.0308918810f;
  EXACT float p3 = p4 * size - 0.0501743046f;
  EXACT float p2 = p3 * size + 0.0889789874f;
  EXACT float p1 = p2 * size - 0.2145988016f;
  EXACT float p0 = p1 * size + 1.5707963050f;
  EXACT float root = rest * reciprocalRoot(rest);
  EXACT float angle = root * p0;
  EXACT float other = 3.14159265f - angle;
  return x < 0.0f ? other : angle;
}
// Of (x, y) from the x axis, -pi to pi; sizes 2^-60 to 2^60, or one of them 0.
SHARED_FUNCTION float arcTangent(float y, float x) {
  EXACT float right = x < 0.0f ? -x : x;
  EXACT float front = y < 0.0f ? -y : y;
  EXACT float t = min(right, front) * reciprocal(max(right, front));
  EXACT float s = t * t;
  EXACT float p7 = 0.0028662257f * s - 0.0161657367f;
  EXACT float p6 = p7 * s + 0.0429096138f;
  EXACT float p5 = p6 * s - 0.0752896400f;
  EXACT float p4 = p5 * s + 0.1065626393f;
  EXACT float p3 = p4 * s - 0.1420889944f;
  EXACT float p2 = p3 * s + 0.1999355085f;
  EXACT float p1 = p2 * s - 0.3333314528f;
  EXACT float octant = t * (1.0f + s * p1);
  EXACT float quadrant = 1.57079633f - octant;
  EXACT float half_ = front > right ? quadrant : octant;
  EXACT float other = 3.14159265f - half_;
  EXACT float above = x < 0.0f ? other : half_;
  return y < 0.0f ? -above : above;
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

// 2^-x for x >= 0, relative error below 3e-7. From 120 on it is 2^-120.
SHARED_FUNCTION float transmitted(float x) {
  EXACT float limited = min(x, 120.0f);
  int whole = int(limited);
  EXACT float f = limited - float(whole);
  EXACT float rest = 1.0f - absorbed(f);
  EXACT float scale = uintBitsToFloat(uint(127 - whole) << 23);
  EXACT float result = scale * rest;
  return result;
}

// -log2(1 - x) for 0 <= x <= 0.5, relative error below 3e-7 near 0 too.
SHARED_FUNCTION float depthOfOpacity(float x) {
  // -ln(1 - x) = 2 artanh z, z = x / (2 - x) <= 1/3.
  EXACT float z = x * reciprocal(2.0f - x);
  EXACT float y = z * z;
  EXACT float p5 = y * (1.0f / 13.0f) + (1.0f / 11.0f);
  EXACT float p4 = p5 * y + (1.0f / 9.0f);
  EXACT float p3 = p4 * y + (1.0f / 7.0f);
  EXACT float p2 = p3 * y + (1.0f / 5.0f);
  EXACT float p1 = p2 * y + (1.0f / 3.0f);
  EXACT float p0 = p1 * y + 1.0f;
  EXACT float result = 2.8853900818f * z * p0;
  return result;
}

// -log2(x) for 0 <= x <= 1; of 0, and of what a GPU may take for it, 127.
SHARED_FUNCTION float depthOfTransmittance(float x) {
  uint bits = floatBitsToUint(x);
  float mantissa = uintBitsToFloat((bits & 0x7fffffu) | 0x3f000000u);
  EXACT float depth = float(126 - int(bits >> 23)) + depthOfOpacity(1.0f - mantissa);
  return depth;
}

FREEVOXEL_END_SHARED

#endif
