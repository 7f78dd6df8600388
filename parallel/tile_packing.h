// Images as messages: only tiles in which there is anything travel.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <span>

#include "base/image.h"

namespace freevoxel {

/// Pixels of a tile: consecutive ones of the image in memory order.
inline constexpr int kCompositeTile = 64;

/// Packs ranges of tiles of images of one size: a bit per tile, in words of 32, then the values of the tiles whose bit
/// is set, in order. No value of an image may be negative, so a tile of zeros has had nothing added to it.
class TilePacking {
 public:
  struct Range {
    size_t first, last;  ///< tiles
    size_t size() const { return last - first; }
  };

  TilePacking(glm::ivec2 imageSize, int channels)
      : channels_(size_t(channels)),
        pixels_(size_t(imageSize.x) * size_t(imageSize.y)),
        tiles_((pixels_ + (kCompositeTile - 1)) / kCompositeTile) {}

  size_t tiles() const { return tiles_; }
  Range all() const { return {0, tiles_}; }
  size_t values() const { return pixels_ * channels_; }  ///< of an image
  static size_t maskWords(Range range) { return (range.size() + 31) / 32; }
  /// That a range takes if all of it is covered, at most.
  size_t mostWords(Range range) const { return maskWords(range) + range.size() * size_t(kCompositeTile) * channels_; }

  bool isCovered(const Image& image, size_t tile) const;
  /// Whether every tile of a range is: then its values can travel as they are.
  bool allCovered(const Image& image, Range range) const;
  /// The values of a range: where they begin among those of the image, and how many they are.
  size_t firstValue(Range range) const { return range.first * size_t(kCompositeTile) * channels_; }
  size_t valueCount(Range range) const {
    return range.size() == 0 ? 0 : std::min(firstValue({range.last, range.last}), values()) - firstValue(range);
  }

  /// Gives the number of words written to `words`.
  size_t pack(const Image& image, Range range, uint32_t* words) const;
  /// Adds what was packed; tiles without a bit stay.
  void add(Image& image, Range range, const uint32_t* words) const;
  /// Puts what was packed in the place of what is there; tiles without a bit stay.
  void replace(Image& image, Range range, const uint32_t* words) const;

 private:
  size_t tileValues(size_t tile) const;
  template <class Put>
  void unpackEach(Image& image, Range range, const uint32_t* words, Put&& put) const;

  size_t channels_, pixels_, tiles_;
};

/// Adds as many floats, given as the words of a message.
void addWords(std::span<float> values, const uint32_t* words);

/// Whether every value of channel c is below limits[c]; channel fastest.
bool allBelow(std::span<const float> values, std::span<const float> limits);

}  // namespace freevoxel
