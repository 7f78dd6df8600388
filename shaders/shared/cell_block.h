// What the ray of a pixel sees in one block: the cell footprint, in GLSL and C++ alike (docs/fidelity.md).
//
// A block owns the part of the ray inside its box, so blocks of whatever levels tile every ray. That part is cut by the
// planes of voxels across the ray's dominant axis (of coarser levels: by every 2^level-th of them), the pieces are
// halved, the value is interpolated at the cuts and classified after that by integrals over it (coarser levels:
// classified voxels are interpolated, by opacity), and the pieces are composited front to back. What lies before the
// block comes in by one factor: attenuation towards the eye, interpolated where the ray comes to the first visible
// piece of the block. Up to there the block itself takes nothing, and there the voxels around are stored ones. Nothing
// here depends on another block, so blocks add in any order.
//
// The file that includes this one defines BLOCK_ACCESS, a parameter (with comma) that functions hand on as
// BLOCK_HAND_ON, and these readers of the block at hand, which count voxels from the corner of its apron, origin - 1:
//   float blockPlace(BLOCK_ACCESS int voxel), blockAttenuation(...), void blockLight(..., out r, out g, out b)
//   TableValue tableIntegral(BLOCK_ACCESS int entry), tableDensity(...)
//   CoverValue blockCover(BLOCK_ACCESS int voxel)
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

// Where place k + t of the dominant axis lies among the level's voxels along it.
struct CellStep {
  int k;
  float t;
};

SHARED_FUNCTION CellStep cellStep(CellLayout layout_, int k, float t) {
  CellStep step_;
  EXACT float shifted = t - layout_.offset;
  step_.k = k;
  if (shifted < 0.0f) {
    step_.k = k - 1;
    shifted = shifted + 1.0f;
  }
  step_.t = shifted;
  return step_;
}

// `ray` counts places of the block's level. At place k + t of the dominant axis, which is `step_` among voxels.
SHARED_FUNCTION CellPlace cellPlace(PixelRay ray, CellLayout layout_, int k, float t, CellStep step_) {
  EXACT float s = float(k) + t;
  EXACT float b = ray.baseB + s * ray.slopeB - layout_.offset;
  EXACT float c = ray.baseC + s * ray.slopeC - layout_.offset;
  b = min(max(b, 0.0f), layout_.lastB);
  c = min(max(c, 0.0f), layout_.lastC);
  int wholeB = int(b);
  int wholeC = int(c);
  CellPlace place;
  place.voxel = (step_.k - layout_.originA + 1) * layout_.strideA + (wholeB - layout_.originB + 1) * layout_.strideB +
                (wholeC - layout_.originC + 1) * layout_.strideC;
  EXACT float restB = b - float(wholeB);
  EXACT float restC = c - float(wholeC);
  place.tb = restB;
  place.tc = restC;
  return place;
}

// The same for attenuation, which does not end at the outermost voxels: half a voxel beyond them, where the volume ends
// towards the eye, nothing is in the way, and the apron says so.
SHARED_FUNCTION CellPlace attenuationPlace(PixelRay ray, CellLayout layout_, int k, float t, CellStep step_) {
  EXACT float s = float(k) + t;
  EXACT float b = ray.baseB + s * ray.slopeB - layout_.offset;
  EXACT float c = ray.baseC + s * ray.slopeC - layout_.offset;
  b = min(max(b, -0.5f), layout_.lastB + 0.5f);
  c = min(max(c, -0.5f), layout_.lastC + 0.5f);
  EXACT float fromApronB = b + 1.0f;
  EXACT float fromApronC = c + 1.0f;
  int wholeB = int(fromApronB);
  int wholeC = int(fromApronC);
  CellPlace place;
  place.voxel = (step_.k - layout_.originA + 1) * layout_.strideA + (wholeB - layout_.originB) * layout_.strideB +
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

// Value, as a place on the table, at place k + t; 0 <= t <= 1. Of level 0, where voxels lie on whole places.
SHARED_FUNCTION float rayPlace(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellStep step_;
  step_.k = k;
  step_.t = t;
  CellPlace at = cellPlace(ray, layout_, k, t, step_);
  if (t == 0.0f) return planePlace(BLOCK_HAND_ON layout_, at, at.voxel);
  if (t == 1.0f) return planePlace(BLOCK_HAND_ON layout_, at, at.voxel + layout_.strideA);
  EXACT float low = planePlace(BLOCK_HAND_ON layout_, at, at.voxel);
  EXACT float high = planePlace(BLOCK_HAND_ON layout_, at, at.voxel + layout_.strideA);
  return mixExact(low, high, t);
}

SHARED_FUNCTION float rayAttenuation(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellStep step_ = cellStep(layout_, k, t);
  CellPlace at = attenuationPlace(ray, layout_, k, t, step_);
  EXACT float low = planeAttenuation(BLOCK_HAND_ON layout_, at, at.voxel);
  EXACT float high = planeAttenuation(BLOCK_HAND_ON layout_, at, at.voxel + layout_.strideA);
  return mixExact(low, high, step_.t);
}

// The largest attenuation of the eight voxels around place k + t.
SHARED_FUNCTION float largestAttenuation(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellPlace at = attenuationPlace(ray, layout_, k, t, cellStep(layout_, k, t));
  float largest = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    int voxel = at.voxel + ((corner & 1) != 0 ? layout_.strideB : 0) + ((corner & 2) != 0 ? layout_.strideC : 0) +
                ((corner & 4) != 0 ? layout_.strideA : 0);
    largest = max(largest, blockAttenuation(BLOCK_HAND_ON voxel));
  }
  return largest;
}

// One of the eight voxels around a place, and its weight there.
struct CellCorner {
  int voxel;
  float weight;
};

SHARED_FUNCTION CellCorner cellCorner(CellLayout layout_, CellPlace at, float t, int corner) {
  CellCorner result;
  result.voxel = at.voxel;
  EXACT float weight = 1.0f;
  if ((corner & 1) != 0) {
    result.voxel += layout_.strideB;
    weight = at.tb;
  } else {
    weight = 1.0f - at.tb;
  }
  if ((corner & 2) != 0) {
    result.voxel += layout_.strideC;
    weight = weight * at.tc;
  } else {
    weight = weight * (1.0f - at.tc);
  }
  if ((corner & 4) != 0) {
    result.voxel += layout_.strideA;
    weight = weight * t;
  } else {
    weight = weight * (1.0f - t);
  }
  result.weight = weight;
  return result;
}

// Light arriving at place k + t, of one colour channel after the other.
SHARED_FUNCTION void rayLight(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t, SHARED_OUT(float) red,
                              SHARED_OUT(float) green, SHARED_OUT(float) blue) {
  CellStep step_ = cellStep(layout_, k, t);
  CellPlace at = cellPlace(ray, layout_, k, t, step_);
  EXACT float r = 0.0f;
  EXACT float g = 0.0f;
  EXACT float b = 0.0f;
  for (int i = 0; i < 8; ++i) {
    CellCorner corner = cellCorner(layout_, at, step_.t, i);
    float lightR, lightG, lightB;
    blockLight(BLOCK_HAND_ON corner.voxel, lightR, lightG, lightB);
    r = r + corner.weight * lightR;
    g = g + corner.weight * lightG;
    b = b + corner.weight * lightB;
  }
  red = r;
  green = g;
  blue = b;
}

// A mixture of voxels of levels from 1 on: colour times opacity, opacity, and transmittance, which is 1 - opacity but
// precise where that is small.
struct CoverMix {
  float red, green, blue, opacity, transmittance;
};

// At place k + t.
SHARED_FUNCTION CoverMix rayCover(BLOCK_ACCESS PixelRay ray, CellLayout layout_, int k, float t) {
  CellStep step_ = cellStep(layout_, k, t);
  CellPlace at = cellPlace(ray, layout_, k, t, step_);
  EXACT float red = 0.0f;
  EXACT float green = 0.0f;
  EXACT float blue = 0.0f;
  EXACT float opacity = 0.0f;
  EXACT float transmittance = 0.0f;
  for (int i = 0; i < 8; ++i) {
    CellCorner corner = cellCorner(layout_, at, step_.t, i);
    CoverValue here = blockCover(BLOCK_HAND_ON corner.voxel);
    EXACT float covered = here.cover < 0.0f ? 1.0f + here.cover : here.cover;
    EXACT float open = here.cover < 0.0f ? -here.cover : 1.0f - here.cover;
    red = red + corner.weight * here.red;
    green = green + corner.weight * here.green;
    blue = blue + corner.weight * here.blue;
    opacity = opacity + corner.weight * covered;
    transmittance = transmittance + corner.weight * open;
  }
  CoverMix result;
  result.red = red;
  result.green = green;
  result.blue = blue;
  result.opacity = opacity;
  result.transmittance = transmittance;
  return result;
}

// What lies between two places along which opacity changes linearly: colour times extinction, extinction.
SHARED_FUNCTION TableValue coverMean(CellLayout layout_, CoverMix from, CoverMix to) {
  EXACT float opacity = 0.5f * (from.opacity + to.opacity);
  TableValue mean;
  mean.red = 0.0f;
  mean.green = 0.0f;
  mean.blue = 0.0f;
  mean.extinction = 0.0f;
  if (!(opacity > kLeastExtinction)) return mean;
  EXACT float transmittance = 0.5f * (from.transmittance + to.transmittance);
  EXACT float depth = opacity <= 0.5f ? depthOfOpacity(opacity) : depthOfTransmittance(min(transmittance, 0.5f));
  EXACT float extinction = depth * layout_.perVoxel * (1.0f / kCoverVoxels);
  EXACT float perOpacity = 0.5f * extinction * reciprocal(opacity);
  EXACT float red = perOpacity * (from.red + to.red);
  EXACT float green = perOpacity * (from.green + to.green);
  EXACT float blue = perOpacity * (from.blue + to.blue);
  mean.red = red;
  mean.green = green;
  mean.blue = blue;
  mean.extinction = extinction;
  return mean;
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

// Cuts from..to down to where the ray lies between low and high on one axis; empty (from >= to) where it does not.
SHARED_FUNCTION void clipRay(float base, float slope, float perSlope, float low, float high, SHARED_INOUT(float) from,
                             SHARED_INOUT(float) to) {
  if (slope == 0.0f) {
    if (!(base >= low && base < high)) to = from;
    return;
  }
  EXACT float atLow = (low - base) * perSlope;
  EXACT float atHigh = (high - base) * perSlope;
  from = max(from, min(atLow, atHigh));
  to = min(to, max(atLow, atHigh));
}

// Optical depth, in log2, that lets through 2^-12.
SHARED_CONSTANT float kHiddenDepth = 12.0f;

// `hiddenBelow`: a ray ends where less than this share of its light would reach the eye; 0 for never.
SHARED_FUNCTION RaySums traceBlock(BLOCK_ACCESS PixelRay finestRay, CellLayout layout_, float hiddenBelow) {
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
  int traced = 0;
  int visible = 0;
  bool eyeAbove = (finestRay.axisAndSide & kRayEyeAbove) != 0u;
  bool classified = layout_.matter >= 0;
  // The ray in places of the block's level. Scaled by a power of two, so exactly the same ray.
  PixelRay ray = finestRay;
  EXACT float baseB = finestRay.baseB * layout_.perVoxel;
  EXACT float baseC = finestRay.baseC * layout_.perVoxel;
  EXACT float lowest = finestRay.sLow * layout_.perVoxel;
  EXACT float highest = finestRay.sHigh * layout_.perVoxel;
  EXACT float lengthPerPlane = finestRay.lengthPerPlane * layout_.voxels;
  ray.baseB = baseB;
  ray.baseC = baseC;
  float from = max(lowest, layout_.lowA);
  float to = min(highest, layout_.highA);
  clipRay(ray.baseB, ray.slopeB, ray.perSlopeB, layout_.lowB, layout_.highB, from, to);
  clipRay(ray.baseC, ray.slopeC, ray.perSlopeC, layout_.lowC, layout_.highC, from, to);
  if (from < to) {
    int first = int(from + 1.0f) - 1;  // rounded down; places start at -1
    int end = int(to + 1.0f);          // rounded up
    if (float(end - 1) >= to) end = end - 1;
    bool haveBefore = false;
    EXACT float before = 0.0f;  // value, or cover, at the end of the piece just done
    CoverMix coverBefore;
    coverBefore.red = 0.0f;
    coverBefore.green = 0.0f;
    coverBefore.blue = 0.0f;
    coverBefore.opacity = 0.0f;
    coverBefore.transmittance = 1.0f;
    for (int i = 0; i < end - first; ++i) {
      int k = eyeAbove ? end - 1 - i : first + i;
      EXACT float low = max(from - float(k), 0.0f);
      EXACT float high = min(to - float(k), 1.0f);
      if (low >= high) continue;
      EXACT float nearEnd = eyeAbove ? high : low;
      EXACT float farEnd = eyeAbove ? low : high;
      EXACT float middle = 0.5f * (low + high);
      if (!inside) {
        inside = true;
        // Nothing lies before the first piece of the ray's way through the volume.
        open = eyeAbove ? to >= highest : from <= lowest;
      }
      if (entered && arriving < hiddenBelow) {
        hidden = true;
        break;
      }
      ++traced;
      TableValue halves[2];
      if (classified) {
        CoverMix coverNear = coverBefore;
        if (!haveBefore) coverNear = rayCover(BLOCK_HAND_ON ray, layout_, k, nearEnd);
        CoverMix coverMiddle = rayCover(BLOCK_HAND_ON ray, layout_, k, middle);
        coverBefore = rayCover(BLOCK_HAND_ON ray, layout_, k, farEnd);
        halves[0] = coverMean(layout_, coverNear, coverMiddle);
        halves[1] = coverMean(layout_, coverMiddle, coverBefore);
      } else {
        EXACT float valueNear = before;
        if (!haveBefore) valueNear = rayPlace(BLOCK_HAND_ON ray, layout_, k, nearEnd);
        EXACT float valueMiddle = rayPlace(BLOCK_HAND_ON ray, layout_, k, middle);
        before = rayPlace(BLOCK_HAND_ON ray, layout_, k, farEnd);
        halves[0] = tableMean(BLOCK_HAND_ON valueNear, valueMiddle);
        halves[1] = tableMean(BLOCK_HAND_ON valueMiddle, before);
      }
      haveBefore = true;
      EXACT float stepLength = 0.5f * (high - low) * lengthPerPlane;
      float lightR = 1.0f, lightG = 1.0f, lightB = 1.0f;
      bool haveLight = false;
      bool seen = false;
      for (int half_ = 0; half_ < 2; ++half_) {
        TableValue mean = halves[half_];
        if (!(mean.extinction > kLeastExtinction)) continue;
        if (!entered) {
          entered = true;
          arriving = open ? 1.0f : rayAttenuation(BLOCK_HAND_ON ray, layout_, k, nearEnd);
          hidden = arriving < hiddenBelow && largestAttenuation(BLOCK_HAND_ON ray, layout_, k, nearEnd) < hiddenBelow;
          if (hidden) break;
        }
        seen = true;
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
      if (seen) ++visible;
    }
  }
  // Less than hiddenBelow reaches the eye from here: that much is before it, even if blocks in front leave a gap.
  if (hidden) depth = depth + kHiddenDepth;
  RaySums sums;
  sums.red = red;
  sums.green = green;
  sums.blue = blue;
  sums.emission = emission;
  sums.depth = depth;
  sums.pieces = traced;
  sums.visiblePieces = visible;
  return sums;
}

FREEVOXEL_END_SHARED

#endif
