#include <algorithm>
#include <cstddef>
#include <vector>

#include "splat/draw_kernels.h"
#include "splat/kernel_tiles.h"
#include "splat/sums.h"

namespace freevoxel {

namespace {

class CpuKernelCanvas final : public KernelCanvas {
 public:
  explicit CpuKernelCanvas(glm::ivec2 imageSize) : size_(imageSize), tiles_(imageSize) {
    for (std::vector<float>& plane : planes_)
      plane.resize(size_t(size_.x) * size_t(size_.y));
  }

  void clear() override {
    for (std::vector<float>& plane : planes_)
      std::fill(plane.begin(), plane.end(), 0.0f);
  }

  void draw(std::span<const KernelSplat> splats) override {
    tiles_.bin(splats.size(), [&](size_t i) -> const KernelSplat& { return splats[i]; });
#pragma omp parallel for schedule(dynamic, 1)
    for (int tile = 0; tile < tiles_.count(); ++tile) {
      for (const uint32_t i : tiles_.splats(tile))
        drawOne(splats[i], tiles_.pixels(tile));
    }
  }

  Image wholeQuanta() override {
    Image image(size_, kSumChannels);
    for (int channel = 0; channel < kSumChannels; ++channel) {
      const std::vector<float>& plane = planes_[channel];
      for (size_t i = 0; i < plane.size(); ++i)
        image.pixels[i * kSumChannels + size_t(channel)] = plane[i];
    }
    return image;
  }

 private:
  void drawOne(const KernelSplat& splat, const PixelRange& bounds) {
    const PixelRange range = intersection(pixelRange(splat, size_), bounds);
    for (int y = range.y0; y < range.y1; ++y) {
      const float dy = (float(y) + 0.5f) - splat.centreY;
      const size_t row = size_t(y) * size_t(size_.x);
      for (int x = range.x0; x < range.x1; ++x) {
        const float dx = (float(x) + 0.5f) - splat.centreX;
        const float weight = shared::kernelWeight(dx, dy, splat.conicXX, splat.conicXY, splat.conicYY);
        float high, low;
        shared::splitDepth(splat.depth64 * weight, high, low);
        const size_t i = row + size_t(x);
        planes_[0][i] += shared::roundToWhole(splat.emissionR * weight);
        planes_[1][i] += shared::roundToWhole(splat.emissionG * weight);
        planes_[2][i] += shared::roundToWhole(splat.emissionB * weight);
        planes_[3][i] += shared::roundToWhole(splat.emissionO * weight);
        planes_[4][i] += high;
        planes_[5][i] += low;
      }
    }
  }

  glm::ivec2 size_;
  KernelTiles tiles_;
  std::vector<float> planes_[kSumChannels];
};

}  // namespace

std::unique_ptr<KernelCanvas> makeCpuKernelCanvas(glm::ivec2 imageSize) {
  return std::make_unique<CpuKernelCanvas>(imageSize);
}

}  // namespace freevoxel
