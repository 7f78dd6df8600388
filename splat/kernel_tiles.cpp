#include "splat/kernel_tiles.h"

#include <algorithm>
#include <cmath>

namespace freevoxel {

PixelRange pixelRange(const shared::KernelSplat& splat, glm::ivec2 imageSize) {
  return {int(std::max(0.0f, std::floor(splat.centreX - splat.extentX))),
          int(std::max(0.0f, std::floor(splat.centreY - splat.extentY))),
          int(std::min(float(imageSize.x), std::ceil(splat.centreX + splat.extentX))),
          int(std::min(float(imageSize.y), std::ceil(splat.centreY + splat.extentY)))};
}

PixelRange intersection(const PixelRange& a, const PixelRange& b) {
  return {std::max(a.x0, b.x0), std::max(a.y0, b.y0), std::min(a.x1, b.x1), std::min(a.y1, b.y1)};
}

KernelTiles::KernelTiles(glm::ivec2 imageSize) : imageSize_(imageSize), count_((imageSize + (kEdge - 1)) / kEdge) {}

PixelRange KernelTiles::pixels(int tile) const {
  const int x = tile % count_.x * kEdge, y = tile / count_.x * kEdge;
  return {x, y, std::min(imageSize_.x, x + kEdge), std::min(imageSize_.y, y + kEdge)};
}

}  // namespace freevoxel
