#include "splat/blend_kernels.h"

#include <algorithm>
#include <cmath>

#include "splat/kernel_tiles.h"

namespace freevoxel {

namespace {

void blendOne(const KernelSplat& splat, BlendKernel kernel, const PixelRange& bounds, Image& image) {
  // v of the shared kernel is (distance / radius)^2, in voxel edges.
  constexpr float kExponent =
      -shared::kKernelRadius * shared::kKernelRadius / (2.0f * kGaussianDeviation * kGaussianDeviation);
  const PixelRange range = intersection(pixelRange(splat, image.size), bounds);
  for (int y = range.y0; y < range.y1; ++y) {
    const float dy = (float(y) + 0.5f) - splat.centreY;
    for (int x = range.x0; x < range.x1; ++x) {
      const float dx = (float(x) + 0.5f) - splat.centreX;
      float weight;
      if (kernel == BlendKernel::normalised) {
        weight = shared::kernelWeight(dx, dy, splat.conicXX, splat.conicXY, splat.conicYY);
      } else {
        const float v = splat.conicXX * dx * dx + splat.conicXY * dx * dy + splat.conicYY * dy * dy;
        weight = v < 1.0f ? std::exp(kExponent * v) : 0.0f;
      }
      if (weight <= 0.0f) continue;
      const float opacity = std::min(splat.emissionO * weight, 1.0f);
      // Where the weight of one splat exceeds what opacity allows, its colour is cut off with it.
      const float shown = splat.emissionO > 0.0f ? opacity / splat.emissionO : 0.0f;
      float* pixel = image.at(x, y);
      pixel[0] = splat.emissionR * shown + (1.0f - opacity) * pixel[0];
      pixel[1] = splat.emissionG * shown + (1.0f - opacity) * pixel[1];
      pixel[2] = splat.emissionB * shown + (1.0f - opacity) * pixel[2];
      pixel[3] = opacity + (1.0f - opacity) * pixel[3];
    }
  }
}

}  // namespace

Image blendKernels(std::vector<BlendSplat> splats, BlendKernel kernel, glm::ivec2 imageSize) {
  std::stable_sort(splats.begin(), splats.end(),
                   [](const BlendSplat& a, const BlendSplat& b) { return a.distance > b.distance; });
  KernelTiles tiles(imageSize);
  tiles.bin(splats.size(), [&](size_t i) -> const KernelSplat& { return splats[i].splat; });
  Image image(imageSize, 4);
#pragma omp parallel for schedule(dynamic, 1)
  for (int tile = 0; tile < tiles.count(); ++tile) {
    for (const uint32_t i : tiles.splats(tile))
      blendOne(splats[i].splat, kernel, tiles.pixels(tile), image);
  }
  return image;
}

}  // namespace freevoxel
