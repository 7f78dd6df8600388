// The 26 lattice directions, pointing from the voxel outwards, in the order in which every file and table has them.
//
// Direction index k of (x,y,z), each -1..1 and not all 0: place n = (z+1)*9 + (y+1)*3 + (x+1) without the middle (13).
// Opposite directions sum to 25. Indices 0..12 point backwards in memory order, 13..25 forwards.
#ifndef FREEVOXEL_SHADERS_SHARED_DIRECTIONS_H
#define FREEVOXEL_SHADERS_SHARED_DIRECTIONS_H

#include "shaders/shared/language.h"

FREEVOXEL_BEGIN_SHARED

SHARED_CONSTANT int kDirectionCount = 26;

SHARED_FUNCTION int directionIndex(int x, int y, int z) {
  int place = (z + 1) * 9 + (y + 1) * 3 + (x + 1);
  return place > 13 ? place - 1 : place;
}

SHARED_FUNCTION int oppositeDirection(int index) {
  return 25 - index;
}

SHARED_FUNCTION int directionPlace(int index) {
  return index > 12 ? index + 1 : index;
}
SHARED_FUNCTION int directionX(int index) {
  return directionPlace(index) % 3 - 1;
}
SHARED_FUNCTION int directionY(int index) {
  return directionPlace(index) / 3 % 3 - 1;
}
SHARED_FUNCTION int directionZ(int index) {
  return directionPlace(index) / 9 - 1;
}

FREEVOXEL_END_SHARED

#endif
