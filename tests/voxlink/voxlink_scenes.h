// Small volumes for the VoxLink tests, none a cube, and what it takes to judge pictures and buffers.
#pragma once

#include <array>
#include <vector>

#include "base/camera.h"
#include "base/image.h"
#include "hierarchy/value_grid.h"
#include "volume/transfer_function.h"
#include "volume/volume.h"
#include "voxlink/buffers.h"

namespace freevoxel::test {

struct VoxLinkScene {
  Volume volume;
  TransferFunction transfer;

  ValueGrid grid() const { return valueGrid(volume, transfer); }
  Box bounds() const { return worldBounds(volume.header.placement, volume.header.dims); }
};

/// 13 x 29 x 7 voxels of unequal spacing, about a third of them visible, in no order.
VoxLinkScene scatteredScene();
/// 21 x 10 x 34 voxels of a smooth float field, with a NaN and an infinity; about half visible.
VoxLinkScene floatScene();
/// A ball above a floor, in 40 x 30 x 36 voxels, nearly opaque.
VoxLinkScene ballAboveAFloor();

/// Cameras round a box at fixed pseudo-random directions, framed to fit; every third is orthographic.
std::vector<Camera> viewsOf(const Box& box, int count, glm::ivec2 imageSize);

/// What a plain loop over the volume finds: x, y, z and code of every voxel whose opacity is above the threshold, in
/// the order of the volume.
std::vector<std::array<int, 4>> plainLoop(const ValueGrid& grid, const TransferFunction& transfer, double threshold);
/// The same of buffers.
std::vector<std::array<int, 4>> voxelsIn(const VoxLinkBuffers& buffers);

/// The grid with every voxel that is not stored made invisible: what ray casting has to see to be compared. The
/// transfer function must hide code 0.
ValueGrid onlyStored(ValueGrid grid, const std::vector<uint8_t>& stored);

/// How two tracers differ. A pixel is flipped where a ray met another voxel, which shows as more than rounding.
struct TracerDifference {
  uint64_t covered = 0, flipped = 0;
  double largestUnflipped = 0.0;
  double meanFlip = 0.0;  ///< signed, of all channels, over covered pixels: 0 if flips have no favourite side
  double psnr = 0.0;
};
TracerDifference compareTracers(const Image& a, const Image& b, float rounding);

}  // namespace freevoxel::test
