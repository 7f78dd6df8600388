// The faces of a brick: what layout compact stores of attenuation (DESIGN section 5).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "shaders/shared/directions.h"

namespace freevoxel {

/// Rows of bytes, one after another.
struct FaceShape {
  int rows = 0;
  int width = 0;
  size_t bytes() const { return size_t(rows) * size_t(width); }
};

/// The voxels of a brick from which one step along a direction leaves the brick, each counted once: across z (rows
/// along x, ascending y), then of the rest those across y (rows along x, ascending z), then of the rest those across x
/// (rows along y, ascending z). A direction that does not step along an axis has no face across it.
struct DirectionFaces {
  FaceShape acrossZ, acrossY, acrossX;

  explicit DirectionFaces(int direction, int edge) {
    const bool x = shared::directionX(direction) != 0;
    const bool y = shared::directionY(direction) != 0;
    const bool z = shared::directionZ(direction) != 0;
    const int restZ = z ? edge - 1 : edge;
    const int restY = y ? edge - 1 : edge;
    if (z) acrossZ = {edge, edge};
    if (y) acrossY = {restZ, edge};
    if (x) acrossX = {restZ, restY};
  }
  std::array<FaceShape, 3> shapes() const { return {acrossZ, acrossY, acrossX}; }
  size_t bytes() const { return acrossZ.bytes() + acrossY.bytes() + acrossX.bytes(); }
};

/// Bytes of the faces of the 13 directions of a pass; both passes have the same: 6628 at edge 16, 27076 at 32.
size_t passFaceBytes(int edge);

/// Copies the face voxels of one direction out of a brick's plane. `plane`: edge^3 bytes along the curve; `steps`:
/// hilbertSteps of the brick; `faces`: DirectionFaces::bytes().
void gatherFaces(const uint8_t* plane, std::span<const uint16_t> steps, int direction, int edge, uint8_t* faces);

}  // namespace freevoxel
