#include "parallel/tile_packing.h"

#include <algorithm>

namespace freevoxel {

void addWords(std::span<float> values, const uint32_t* words) {
  for (size_t i = 0; i < values.size(); ++i) {
    float value;
    std::memcpy(&value, words + i, sizeof value);
    values[i] += value;
  }
}

bool allBelow(std::span<const float> values, std::span<const float> limits) {
  bool below = true;
  for (size_t i = 0; i < values.size(); i += limits.size()) {
    for (size_t c = 0; c < limits.size(); ++c)
      below = below && values[i + c] < limits[c];
  }
  return below;
}

size_t TilePacking::tileValues(size_t tile) const {
  return std::min(size_t(kCompositeTile), pixels_ - tile * kCompositeTile) * channels_;
}

bool TilePacking::isCovered(const Image& image, size_t tile) const {
  const float* values = image.pixels.data() + tile * kCompositeTile * channels_;
  // A tile that is covered mostly shows it at once.
  constexpr size_t kAtOnce = 32;
  for (size_t first = 0, count = tileValues(tile); first < count; first += kAtOnce) {
    uint32_t bits = 0;
    for (size_t i = first; i < std::min(first + kAtOnce, count); ++i) {
      uint32_t word;
      std::memcpy(&word, values + i, sizeof word);
      bits |= word;
    }
    if (bits != 0) return true;
  }
  return false;
}

bool TilePacking::allCovered(const Image& image, Range range) const {
  for (size_t tile = range.first; tile < range.last; ++tile) {
    if (!isCovered(image, tile)) return false;
  }
  return true;
}

size_t TilePacking::pack(const Image& image, Range range, uint32_t* words) const {
  std::fill_n(words, maskWords(range), 0u);
  uint32_t* out = words + maskWords(range);
  for (size_t tile = range.first; tile < range.last; ++tile) {
    if (!isCovered(image, tile)) continue;
    words[(tile - range.first) / 32] |= 1u << (tile - range.first) % 32;
    std::memcpy(out, image.pixels.data() + tile * kCompositeTile * channels_, tileValues(tile) * sizeof(float));
    out += tileValues(tile);
  }
  return size_t(out - words);
}

template <class Put>
void TilePacking::unpackEach(Image& image, Range range, const uint32_t* words, Put&& put) const {
  const uint32_t* from = words + maskWords(range);
  for (size_t tile = range.first; tile < range.last; ++tile) {
    if ((words[(tile - range.first) / 32] >> (tile - range.first) % 32 & 1u) == 0) continue;
    const size_t count = tileValues(tile);
    put(image.pixels.data() + tile * kCompositeTile * channels_, from, count);
    from += count;
  }
}

void TilePacking::add(Image& image, Range range, const uint32_t* words) const {
  unpackEach(image, range, words, [](float* values, const uint32_t* from, size_t count) {
    addWords({values, count}, from);
  });
}

void TilePacking::replace(Image& image, Range range, const uint32_t* words) const {
  unpackEach(image, range, words, [](float* values, const uint32_t* from, size_t count) {
    std::memcpy(values, from, count * sizeof(float));
  });
}

}  // namespace freevoxel
