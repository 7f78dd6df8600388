#include "precompute/brick_faces.h"

#include "precompute/format.h"

namespace freevoxel {

size_t passFaceBytes(int edge) {
  size_t bytes = 0;
  for (int direction = 0; direction < kDirectionsPerSection; ++direction)
    bytes += DirectionFaces(direction, edge).bytes();
  return bytes;
}

void gatherFaces(const uint8_t* plane, std::span<const uint16_t> steps, int direction, int edge, uint8_t* faces) {
  const DirectionFaces shapes(direction, edge);
  const int dx = shared::directionX(direction), dy = shared::directionY(direction), dz = shared::directionZ(direction);
  const int outerX = dx > 0 ? edge - 1 : 0, outerY = dy > 0 ? edge - 1 : 0, outerZ = dz > 0 ? edge - 1 : 0;
  // What the faces before have taken is left out.
  const int firstZ = dz < 0 ? 1 : 0, firstY = dy < 0 ? 1 : 0;
  const auto at = [&](int x, int y, int z) { return plane[steps[size_t(x + edge * (y + edge * z))]]; };
  for (int y = 0; y < shapes.acrossZ.rows; ++y) {
    for (int x = 0; x < edge; ++x)
      *faces++ = at(x, y, outerZ);
  }
  for (int z = 0; z < shapes.acrossY.rows; ++z) {
    for (int x = 0; x < edge; ++x)
      *faces++ = at(x, outerY, firstZ + z);
  }
  for (int z = 0; z < shapes.acrossX.rows; ++z) {
    for (int y = 0; y < shapes.acrossX.width; ++y)
      *faces++ = at(outerX, firstY + y, firstZ + z);
  }
}

}  // namespace freevoxel
