// Which splats reach into which tile of the image.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

#include "shaders/shared/kernel_splat.h"

namespace freevoxel {

/// Pixels x0 <= x < x1, y0 <= y < y1.
struct PixelRange {
  int x0, y0, x1, y1;
};

/// Pixels whose centres may lie inside the splat, clipped to the image.
PixelRange pixelRange(const shared::KernelSplat& splat, glm::ivec2 imageSize);
PixelRange intersection(const PixelRange& a, const PixelRange& b);

/// Splats binned by square tiles of the image, in their order within each tile.
class KernelTiles {
 public:
  static constexpr int kEdge = 64;  ///< pixels: six float planes of it fit the first-level cache of a core

  explicit KernelTiles(glm::ivec2 imageSize);
  /// Calls splatAt(i) for i in 0..count - 1.
  template <class SplatAt>
  void bin(size_t count, SplatAt&& splatAt) {
    start_.assign(size_t(count_.x) * size_t(count_.y) + 1, 0);
    for (size_t i = 0; i < count; ++i)
      forEachTile(splatAt(i), [&](size_t tile) { ++start_[tile + 1]; });
    for (size_t tile = 1; tile < start_.size(); ++tile)
      start_[tile] += start_[tile - 1];
    binned_.resize(start_.back());
    std::vector<uint64_t> next(start_.begin(), start_.end() - 1);
    for (size_t i = 0; i < count; ++i)
      forEachTile(splatAt(i), [&](size_t tile) { binned_[next[tile]++] = uint32_t(i); });
  }

  int count() const { return count_.x * count_.y; }
  PixelRange pixels(int tile) const;
  /// Numbers of the splats that reach into the tile.
  std::span<const uint32_t> splats(int tile) const {
    return std::span(binned_).subspan(start_[size_t(tile)], start_[size_t(tile) + 1] - start_[size_t(tile)]);
  }

 private:
  template <class F>
  void forEachTile(const shared::KernelSplat& splat, F&& f) const {
    const PixelRange range = pixelRange(splat, imageSize_);
    if (range.x0 >= range.x1 || range.y0 >= range.y1) return;
    for (int y = range.y0 / kEdge; y <= (range.y1 - 1) / kEdge; ++y) {
      for (int x = range.x0 / kEdge; x <= (range.x1 - 1) / kEdge; ++x)
        f(size_t(y * count_.x + x));
    }
  }

  glm::ivec2 imageSize_, count_;
  std::vector<uint64_t> start_;
  std::vector<uint32_t> binned_;
};

}  // namespace freevoxel
