// What the ray of a pixel sees in one block: the cell footprint, in GLSL and C++ alike (docs/fidelity.md).
//
// The ray is cut by the planes of voxels across its dominant axis; a piece between two planes belongs to the block that
// holds its end at the lower plane, so blocks tile every ray. Pieces are halved, the value is interpolated at the cuts
// and classified after that by integrals over it, and the pieces of a block are composited front to back. What lies
// before the block comes in by one factor: attenuation towards the eye, interpolated where the ray comes to the first
// visible piece of the block. Up to there the block itself takes nothing, and there the voxels around are stored ones.
// Nothing here depends on another block, so blocks add in any order.
//
// The file that includes this one defines BLOCK_ACCESS, a parameter (with comma) that functions hand on as
// BLOCK_HAND_ON, and these readers of the block at hand, which count voxels from the corner of its apron, origin - 1:
//   float blockPlace(BLOCK_ACCESS int voxel), blockAttenuation(...), void blockLight(..., out r, out g, out b)
//   void tableIntegral(BLOCK_ACCESS int entry, out TableValue), tableDensity(...)
#ifndef FREEVOXEL_SHADERS_SHARED_CELL_BLOCK_H
#define FREEVOXEL_SHADERS_SHARED_CELL_BLOCK_H

#include "shaders/shared/cell_segment.h"
#include "shaders/shared/exact_math.h"
#include "shaders/shared/language.h"

FREEVOXEL_BEGIN_SHARED

// Where in a block the interpolation happens: index of the lowest of eight voxels, steps to the others, and weights.
struct CellPlace {
  int voxel;
  float tb, tc;
};

SHARED_FUNCTION float mixExact(float a, float b, float t) {
  EXACT float difference = b - a;
  EXACT float result = a + t * difference;
  return result;
}

// Position s = k + t on the dominant axis; voxels are counted from the apron's corner.
SHARED_FUNCTION CellPlace cellPlace(PixelRay ray, CellLayout layout_, int k, float t) {
  EXACT float s = float(k) + t;
  EXACT float b = ray.baseB + s * ray.slopeB;
  EXACT float c = ray.baseC + s * ray.slopeC;
  b = min(max(b, 0.0f), layout_.lastB);
  c = min(max(c, 0.0f), layout_.lastC);
  int wholeB = int(b);
  int wholeC = int(c);
  CellPlace place;
  place.voxel = (k - layout_.originA + 1) * layout_.strideA + (wholeB - layout_.originB + 1) * layout_.strideB +
                (wholeC - layout_.originC + 1) * layout_.strideC;
  EXACT float restB = b - float(wholeB);
  EXACT float restC = c - float(wholeC);
  place.tb = restB;
  place.tc = restC;
  return place;
}

// The same for attenuation, which does not end at the outermost voxels: half a voxel beyond them, where the volume ends
// towards the eye, nothing is in the way, and the apron says so.
SHARED_FUNCTION CellPlace attenuationPlace(PixelRay ray, CellLayout layout_, int k, float t) {
  EXACT float s = float(k) + t;
  EXACT float b = ray.baseB + s * ray.slopeB;
  EXACT float c = ray.baseC + s * ray.slopeC;
  b = min(max(b, -0.5f), layout_.lastB + 0.5f);
  c = min(max(c, -0.5f), layout_.lastC + 0.5f);
  EXACT float fromApronB = b + 1.0f;
  EXACT float fromApronC = c + 1.0f;
  int wholeB = int(fromApronB);
  int wholeC = int(fromApronC);
  CellPlace place;
  place.voxel = (k - layout_.originA + 1) * layout_.strideA + (wholeB - layout_.originB) * layout_.strideB +
                (wholeC - layout_.originC) * layout_.strideC;
  EXACT float restB = fromApronB - float(wholeB);
  EXACT float restC = fromApronC - float(wholeC);
  place.tb = restB;
  place.tc = restC;
  return place;
}

SHARED_FUNCTION float planePlace(BLOCK_ACCESS CellLayout layout_, CellPlace at, int voxel) {
  EXACT float low = mixExact(blockPlace(BLOCK_HAND_ON voxel), blockPlace(BLOCK_HAND_ON voxel + layout_.strideB), at.tb);
  EXACT float high = mixExact(blockPlace(BLOCK_HAND_ON voxel + layout_.strideC),
                              blockPlace(BLOCK_HAND_ON voxel + layout_.strideB + layout_.strideC), at.tb);
  return mixExact(low, high, at.tc);
}

SHARED_FUNCTION float planeAttenuation(BLOCK_ACCESS CellLayout layout_, CellPlace at, int voxel) {
  EXACT float low =
      mixExact(blockAttenuation(BLOCK_HAND_ON voxel), blockAttenuation(BLOCK_HAND_ON voxel + layout_.strideB), at.tb);
  EXACT float high = mixExact(blockAttenuation(BLOCK_HAND_ON voxel + layout_.strideC),
                              blockAttenuation(BLOCK_HAND_ON voxel + layout_.strideB + layout_.strideC), at.tb);
  return mixExact(low, high, at.tc);
}

// Value, as a place on the table, at position k + t; 0 <= t <= 1.
SHARED_FUNCTION float rayPlace(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellPlace at = cellPlace(ray, layout_, k, t);
  if (t == 0.0f) return planePlace(BLOCK_HAND_ON layout_, at, at.voxel);
  if (t == 1.0f) return planePlace(BLOCK_HAND_ON layout_, at, at.voxel + layout_.strideA);
  EXACT float low = planePlace(BLOCK_HAND_ON layout_, at, at.voxel);
  EXACT float high = planePlace(BLOCK_HAND_ON layout_, at, at.voxel + layout_.strideA);
  return mixExact(low, high, t);
}

SHARED_FUNCTION float rayAttenuation(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellPlace at = attenuationPlace(ray, layout_, k, t);
  EXACT float low = planeAttenuation(BLOCK_HAND_ON layout_, at, at.voxel);
  EXACT float high = planeAttenuation(BLOCK_HAND_ON layout_, at, at.voxel + layout_.strideA);
  return mixExact(low, high, t);
}

// The largest attenuation of the eight voxels around position k + t.
SHARED_FUNCTION float largestAttenuation(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellPlace at = attenuationPlace(ray, layout_, k, t);
  float largest = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    int voxel = at.voxel + ((corner & 1) != 0 ? layout_.strideB : 0) + ((corner & 2) != 0 ? layout_.strideC : 0) +
                ((corner & 4) != 0 ? layout_.strideA : 0);
    largest = max(largest, blockAttenuation(BLOCK_HAND_ON voxel));
  }
  return largest;
}

// Light arriving at position k + t, of one colour channel after the other.
SHARED_FUNCTION void rayLight(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t, SHARED_OUT(float) red,
                              SHARED_OUT(float) green, SHARED_OUT(float) blue) {
  CellPlace at = cellPlace(ray, layout_, k, t);
  EXACT float r = 0.0f;
  EXACT float g = 0.0f;
  EXACT float b = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    int voxel = at.voxel;
    EXACT float weight = 1.0f;
    if ((corner & 1) != 0) {
      voxel += layout_.strideB;
      weight = at.tb;
    } else {
      weight = 1.0f - at.tb;
    }
    if ((corner & 2) != 0) {
      voxel += layout_.strideC;
      weight = weight * at.tc;
    } else {
      weight = weight * (1.0f - at.tc);
    }
    if ((corner & 4) != 0) {
      voxel += layout_.strideA;
      weight = weight * t;
    } else {
      weight = weight * (1.0f - t);
    }
    float lightR, lightG, lightB;
    blockLight(BLOCK_HAND_ON voxel, lightR, lightG, lightB);
    r = r + weight * lightR;
    g = g + weight * lightG;
    b = b + weight * lightB;
  }
  red = r;
  green = g;
  blue = b;
}

SHARED_FUNCTION TableValue tableAt(BLOCK_ACCESS float place) {
  int entry = int(place);
  EXACT float rest = place - float(entry);
  TableValue start = tableIntegral(BLOCK_HAND_ON entry);
  TableValue density = tableDensity(BLOCK_HAND_ON entry);
  TableValue result;
  EXACT float r = start.red + rest * density.red;
  EXACT float g = start.green + rest * density.green;
  EXACT float b = start.blue + rest * density.blue;
  EXACT float e = start.extinction + rest * density.extinction;
  result.red = r;
  result.green = g;
  result.blue = b;
  result.extinction = e;
  return result;
}

// Mean of the table between two places.
SHARED_FUNCTION TableValue tableMean(BLOCK_ACCESS float from, float to) {
  EXACT float difference = to - from;
  EXACT float size = max(difference, -difference);
  if (size < kNearlyEqual) {
    EXACT float middle = 0.5f * (from + to);
    return tableDensity(BLOCK_HAND_ON int(middle));
  }
  TableValue start = tableAt(BLOCK_HAND_ON from);
  TableValue end = tableAt(BLOCK_HAND_ON to);
  EXACT float inverse = reciprocal(size);
  if (difference < 0.0f) inverse = -inverse;
  TableValue mean;
  EXACT float r = (end.red - start.red) * inverse;
  EXACT float g = (end.green - start.green) * inverse;
  EXACT float b = (end.blue - start.blue) * inverse;
  EXACT float e = (end.extinction - start.extinction) * inverse;
  mean.red = max(r, 0.0f);
  mean.green = max(g, 0.0f);
  mean.blue = max(b, 0.0f);
  mean.extinction = max(e, 0.0f);
  return mean;
}

// `hiddenBelow`: a ray ends where less than this share of its light would reach the eye; 0 for never.
SHARED_FUNCTION RaySums traceBlock(BLOCK_ACCESS PixelRay ray, CellLayout layout_, float hiddenBelow) {
  EXACT float red = 0.0f;
  EXACT float green = 0.0f;
  EXACT float blue = 0.0f;
  EXACT float emission = 0.0f;
  EXACT float depth = 0.0f;
  EXACT float arriving = 0.0f;  // attenuation at the entry, times what the block itself has let through since
  bool inside = false;          // whether the ray has come to a piece of the block
  bool open = false;            // whether nothing lies before the first of them
  bool entered = false;         // whether it has come to something visible
  bool hidden = false;
  bool eyeAbove = (ray.axisAndSide & kRayEyeAbove) != 0u;
  EXACT float before = 0.0f;  // value at the end of the piece just done
  bool haveBefore = false;
  int pieces = layout_.endA - layout_.firstA;
  int traced = 0;
  for (int i = 0; i < pieces; ++i) {
    int k = eyeAbove ? layout_.endA - 1 - i : layout_.firstA + i;
    EXACT float b = ray.baseB + float(k) * ray.slopeB;
    EXACT float c = ray.baseC + float(k) * ray.slopeC;
    bool owned = b >= layout_.ownLowB && b < layout_.ownHighB && c >= layout_.ownLowC && c < layout_.ownHighC;
    EXACT float low = max(ray.sLow - float(k), 0.0f);
    EXACT float high = min(ray.sHigh - float(k), 1.0f);
    if (!owned || low >= high) {
      haveBefore = false;
      continue;
    }
    EXACT float nearEnd = eyeAbove ? high : low;
    EXACT float farEnd = eyeAbove ? low : high;
    EXACT float middle = 0.5f * (low + high);
    if (!inside) {
      inside = true;
      // Nothing lies before the first piece of the ray's way through the volume.
      open = eyeAbove ? ray.sHigh <= float(k + 1) : ray.sLow >= float(k);
    }
    if (entered && arriving < hiddenBelow) break;
    ++traced;
    EXACT float valueNear = haveBefore ? before : rayPlace(BLOCK_HAND_ON ray, layout_, k, nearEnd);
    EXACT float valueMiddle = rayPlace(BLOCK_HAND_ON ray, layout_, k, middle);
    EXACT float valueFar = rayPlace(BLOCK_HAND_ON ray, layout_, k, farEnd);
    before = valueFar;
    haveBefore = true;
    EXACT float stepLength = 0.5f * (high - low) * ray.lengthPerPlane;
    float lightR = 1.0f, lightG = 1.0f, lightB = 1.0f;
    bool haveLight = false;
    for (int half_ = 0; half_ < 2; ++half_) {
      TableValue mean =
          half_ == 0 ? tableMean(BLOCK_HAND_ON valueNear, valueMiddle) : tableMean(BLOCK_HAND_ON valueMiddle, valueFar);
      if (!(mean.extinction > kLeastExtinction)) continue;
      if (!entered) {
        entered = true;
        arriving = open ? 1.0f : rayAttenuation(BLOCK_HAND_ON ray, layout_, k, nearEnd);
        hidden = arriving < hiddenBelow && largestAttenuation(BLOCK_HAND_ON ray, layout_, k, nearEnd) < hiddenBelow;
        if (hidden) break;
      }
      EXACT float pieceDepth = mean.extinction * stepLength;
      EXACT float taken = absorbed(pieceDepth);
      EXACT float emitted = arriving * taken;
      EXACT float perExtinction = emitted * reciprocal(mean.extinction);
      arriving = arriving - emitted;
      if (layout_.lit != 0 && !haveLight) {
        rayLight(BLOCK_HAND_ON ray, layout_, k, middle, lightR, lightG, lightB);
        haveLight = true;
      }
      red = red + perExtinction * mean.red * lightR;
      green = green + perExtinction * mean.green * lightG;
      blue = blue + perExtinction * mean.blue * lightB;
      emission = emission + emitted;
      depth = depth + pieceDepth;
    }
    if (hidden) break;
  }
  RaySums sums;
  sums.red = red;
  sums.green = green;
  sums.blue = blue;
  sums.emission = emission;
  sums.depth = depth;
  sums.pieces = traced;
  return sums;
}

FREEVOXEL_END_SHARED

#endif
