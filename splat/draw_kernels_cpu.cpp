#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "splat/draw_kernels.h"

namespace freevoxel {

namespace {

constexpr int kTile = 64;  // pixels an edge: six float planes of it fit the first-level cache of a core

/// Pixels whose centres may lie inside the splat, clipped to the image.
struct PixelRange {
  int x0, y0, x1, y1;
};

PixelRange pixelRange(const KernelSplat& splat, glm::ivec2 size) {
  return {int(std::max(0.0f, std::floor(splat.centreX - splat.extentX))),
          int(std::max(0.0f, std::floor(splat.centreY - splat.extentY))),
          int(std::min(float(size.x), std::ceil(splat.centreX + splat.extentX))),
          int(std::min(float(size.y), std::ceil(splat.centreY + splat.extentY)))};
}

class CpuKernelCanvas final : public KernelCanvas {
 public:
  explicit CpuKernelCanvas(glm::ivec2 imageSize)
      : size_(imageSize), tiles_((imageSize.x + kTile - 1) / kTile, (imageSize.y + kTile - 1) / kTile) {
    for (std::vector<float>& plane : planes_)
      plane.resize(size_t(size_.x) * size_t(size_.y));
  }

  void clear() override {
    for (std::vector<float>& plane : planes_)
      std::fill(plane.begin(), plane.end(), 0.0f);
  }

  void draw(std::span<const KernelSplat> splats) override {
    binSplats(splats);
    const int tileCount = tiles_.x * tiles_.y;
#pragma omp parallel for schedule(dynamic, 1)
    for (int tile = 0; tile < tileCount; ++tile) {
      const PixelRange bounds{tile % tiles_.x * kTile, tile / tiles_.x * kTile,
                              std::min(size_.x, (tile % tiles_.x + 1) * kTile),
                              std::min(size_.y, (tile / tiles_.x + 1) * kTile)};
      for (uint32_t i = binStart_[size_t(tile)]; i < binStart_[size_t(tile) + 1]; ++i) {
        drawOne(splats[binned_[i]], bounds);
      }
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
  /// Lists, for each tile, the splats that reach into it, in their order: binned_[binStart_[t] .. binStart_[t + 1]).
  void binSplats(std::span<const KernelSplat> splats) {
    const auto forEachTile = [&](const KernelSplat& splat, auto&& f) {
      const PixelRange range = pixelRange(splat, size_);
      if (range.x0 >= range.x1 || range.y0 >= range.y1) return;
      for (int y = range.y0 / kTile; y <= (range.y1 - 1) / kTile; ++y) {
        for (int x = range.x0 / kTile; x <= (range.x1 - 1) / kTile; ++x)
          f(size_t(y * tiles_.x + x));
      }
    };
    binStart_.assign(size_t(tiles_.x) * size_t(tiles_.y) + 1, 0);
    for (const KernelSplat& splat : splats)
      forEachTile(splat, [&](size_t tile) { ++binStart_[tile + 1]; });
    for (size_t tile = 1; tile < binStart_.size(); ++tile)
      binStart_[tile] += binStart_[tile - 1];
    binned_.resize(binStart_.back());
    std::vector<uint32_t> next(binStart_.begin(), binStart_.end() - 1);
    for (size_t i = 0; i < splats.size(); ++i) {
      forEachTile(splats[i], [&](size_t tile) { binned_[next[tile]++] = uint32_t(i); });
    }
  }

  void drawOne(const KernelSplat& splat, const PixelRange& bounds) {
    PixelRange range = pixelRange(splat, size_);
    range = {std::max(range.x0, bounds.x0), std::max(range.y0, bounds.y0), std::min(range.x1, bounds.x1),
             std::min(range.y1, bounds.y1)};
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
  glm::ivec2 tiles_;
  std::vector<float> planes_[kSumChannels];
  std::vector<uint32_t> binStart_;
  std::vector<uint32_t> binned_;
};

}  // namespace

std::unique_ptr<KernelCanvas> makeCpuKernelCanvas(glm::ivec2 imageSize) {
  return std::make_unique<CpuKernelCanvas>(imageSize);
}

}  // namespace freevoxel
