// What the cell footprint hands from the CPU to whatever draws it, in GLSL and C++ alike (docs/fidelity.md).
#ifndef FREEVOXEL_SHADERS_SHARED_CELL_SEGMENT_H
#define FREEVOXEL_SHADERS_SHARED_CELL_SEGMENT_H

#include "shaders/shared/exact_math.h"
#include "shaders/shared/language.h"

FREEVOXEL_BEGIN_SHARED

// A pixel's ray in index space, along its dominant axis a: at position s on that axis it is at baseB + s slopeB and
// baseC + s slopeC on the next two (b = a + 1, c = a + 2, modulo 3). The same layout in std430.
struct PixelRay {
  float baseB, baseC;
  float slopeB, slopeC;
  // 1 / slopeB and 1 / slopeC; 0 where the slope is 0, which slopes are that move a ray by nothing.
  float perSlopeB, perSlopeC;
  // The part of the ray inside the volume's box and before the eye, in units of s; empty if sLow >= sHigh.
  float sLow, sHigh;
  // Way through the volume per unit of s, in shortest voxel edges.
  float lengthPerPlane;
  // Dominant axis 0..2, plus 4 if the eye lies towards higher s.
  uint axisAndSide;
};

SHARED_CONSTANT uint kRayAxisMask = 3u;
SHARED_CONSTANT uint kRayEyeAbove = 4u;

// Entries of the classification table closer together than this are averaged by the density between them: the
// difference of two integrals would lose its digits.
SHARED_CONSTANT float kNearlyEqual = 0.5f;

// Less than any extinction that a picture could show, in log2 per shortest voxel edge.
SHARED_CONSTANT float kLeastExtinction = 1e-9f;

// A place on the classification table: colour times extinction, and extinction in log2 per shortest voxel edge.
struct TableValue {
  float red, green, blue, extinction;
};

// A voxel of levels from 1 on, as blocks hold it: colour times opacity, and opacity over kCoverVoxels shortest edges of
// the level. Above one half, `cover` is minus what is let through, which then is the more precise.
struct CoverValue {
  float red, green, blue, cover;
};

// Opacity over so many voxels is what is interpolated between voxels of coarser levels. Interpolated extinction would
// let opaque matter swell: a tenth of what is opaque is opaque still (docs/fidelity.md).
SHARED_CONSTANT float kCoverVoxels = 4.0f;

// A block as rays along one dominant axis a see it, with b and c as in PixelRay. Places count voxels of the block's
// level from the corner that is voxel (0,0,0) of the finest one, so that a place is 2^-level times that of the finest
// level: voxel n of a level lies at place n + offset.
struct CellLayout {
  int originA, originB, originC;  // first voxel
  int strideA, strideB, strideC;  // in the block's array, which starts at origin - 1
  // What the block owns of every ray: the part inside this box, as far as something is visible there. Blocks that touch
  // have one number for the face between them, whatever their levels.
  float lowA, highA, lowB, highB, lowC, highC;
  float lastB, lastC;  // of the level's voxels
  float perVoxel;      // 2^-level
  float voxels;        // 2^level
  float offset;        // (1 - 2^-level) / 2
  int lit;             // 0 or 1: whether voxels have light of their own
  int samples;         // where the block's array starts, in voxels
  int matter;  // the same in the array of classified voxels; -1: voxels have values, which is so at level 0 only
};

// What one block gives to one pixel; depth in log2. `pieces`: how many pieces of the ray that took,
// `visiblePieces`: in how many of them something is visible.
struct RaySums {
  float red, green, blue, emission, depth;
  int pieces;
  int visiblePieces;
};

FREEVOXEL_END_SHARED

#endif
