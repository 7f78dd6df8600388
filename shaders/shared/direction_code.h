// Packs directions to 16 bits, polar, by + - * and comparisons alone, so that every backend packs alike. Whoever
// includes this defines DIRECTION_TABLE(i), entry i of a table of kDirectionTable numbers (voxlink/direction_code.h
// fills it).
#ifndef FREEVOXEL_SHADERS_SHARED_DIRECTION_CODE_H
#define FREEVOXEL_SHADERS_SHARED_DIRECTION_CODE_H

#include "shaders/shared/scene_voxel.h"

FREEVOXEL_BEGIN_SHARED

// First, for angles half way between two polar codes, the square of the cosine with its sign; then, for angles half way
// between two azimuth codes in the first quadrant, cosine and sine.
SHARED_CONSTANT int kPolarSteps = 255;
SHARED_CONSTANT int kQuadrantSteps = 64;
SHARED_CONSTANT int kDirectionTable = 255 + 2 * 64;

// The nearest code of a direction of any length but 0, each component below 2^24 in size.
SHARED_FUNCTION uint packDirection(float x, float y, float z) {
  EXACT float across = x * x;
  EXACT float other = y * y;
  EXACT float up = z * z;
  EXACT float flat_ = across + other;
  EXACT float sum = flat_ + up;
  float height = z < 0.0f ? -up : up;
  // Codes whose upper end is still above the direction.
  int low = 0, high = kPolarSteps;
  while (low < high) {
    int middle = (low + high) / 2;
    EXACT float limit = DIRECTION_TABLE(middle) * sum;
    if (height < limit) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  uint polar = uint(low);
  float right = x < 0.0f ? -x : x, front = y < 0.0f ? -y : y;
  low = 0;
  high = flat_ > 0.0f ? kQuadrantSteps : 0;
  while (low < high) {
    int middle = (low + high) / 2;
    EXACT float a = front * DIRECTION_TABLE(kPolarSteps + 2 * middle);
    EXACT float b = right * DIRECTION_TABLE(kPolarSteps + 2 * middle + 1);
    if (a > b) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  int turn = x < 0.0f ? (y < 0.0f ? 128 + low : 128 - low) : (y < 0.0f ? 256 - low : low);
  return packedDirection(polar, uint(turn) & 255u);
}

FREEVOXEL_END_SHARED

#endif
