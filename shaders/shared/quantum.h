// Rounding every contribution to whole quanta, so that float sums are exact in any order (DESIGN section 4).
#ifndef FREEVOXEL_SHADERS_SHARED_QUANTUM_H
#define FREEVOXEL_SHADERS_SHARED_QUANTUM_H

#include "shaders/shared/language.h"

FREEVOXEL_BEGIN_SHARED

// Sums of non-negative whole numbers are exact in float32 as long as the result is below this.
SHARED_CONSTANT float kExactLimit = 16777216.0f;  // 2^24

// Optical depth has two sums: one in units of 1/64, and the rest in units of 1/65536.
SHARED_CONSTANT float kDepthHighUnit = 0.015625f;           // 2^-6
SHARED_CONSTANT float kDepthLowUnit = 0.0000152587890625f;  // 2^-16
SHARED_CONSTANT float kDepthLowPerHigh = 1024.0f;
// 64 times an optical depth that is given in units of log2: 64 ln 2.
SHARED_CONSTANT float kDepth64FromLog2 = 44.3614196f;

// The nearest whole number, ties to even, of 0 <= x <= 2^23; greater x comes back within 1 (and fails the exactness
// check anyway). The sum must not be simplified away: hence EXACT.
SHARED_FUNCTION float roundToWhole(float x) {
  EXACT float shifted = x + 8388608.0f;  // 2^23: floats from here on are whole
  EXACT float whole = shifted - 8388608.0f;
  return whole;
}

// Splits 64 times an optical depth into whole units of both sums.
SHARED_FUNCTION void splitDepth(float depth64, SHARED_OUT(float) high, SHARED_OUT(float) low) {
  EXACT float whole = float(int(depth64));
  EXACT float rest = (depth64 - whole) * kDepthLowPerHigh;
  high = whole;
  low = roundToWhole(rest);
}

FREEVOXEL_END_SHARED

#endif
