// Pictures in memory, and PNG and EXR files of them.
#pragma once

#include <glm/vec2.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace freevoxel {

/// Interleaved float channels, row 0 at the top, channel fastest: pixels[(y * size.x + x) * channels + c].
/// Pictures have 4 channels: premultiplied linear RGB and alpha. Sums have 6 (see splat/sums.h).
/// Invariant: pixels.size() == size.x * size.y * channels.
struct Image {
  glm::ivec2 size{0};
  int channels = 0;
  std::vector<float> pixels;

  Image() = default;
  /// All zero.
  Image(glm::ivec2 imageSize, int channelCount);

  float* at(int x, int y) { return pixels.data() + (size_t(y) * size_t(size.x) + size_t(x)) * size_t(channels); }
  const float* at(int x, int y) const {
    return pixels.data() + (size_t(y) * size_t(size.x) + size_t(x)) * size_t(channels);
  }
};

/// Name and text pairs stored in the file: at least "Software" and the command that made the picture ("Command").
using ImageMetadata = std::vector<std::pair<std::string, std::string>>;

/// sRGB transfer of one channel, 0..1 (values outside are clamped).
float srgbFromLinear(float linear);
float linearFromSrgb(float srgb);

/// Writes premultiplied linear RGBA as an 8-bit sRGB PNG, opaque unless `keepAlpha` (PNG alpha is not premultiplied).
/// The file appears whole or not at all. Throws MachineError if it cannot be written.
void writePng(const std::string& path, const Image& image, const ImageMetadata& metadata, bool keepAlpha = false);

/// Writes every channel as 32-bit float EXR, lossless; `channelNames` has one name per channel, e.g. {"R","G","B","A"}.
/// The file appears whole or not at all. Throws MachineError if it cannot be written.
void writeExr(const std::string& path, const Image& image, std::span<const std::string> channelNames,
              const ImageMetadata& metadata);

/// Reads PNG (sRGB turned to linear, alpha premultiplied) or EXR (as stored). Throws InputError.
Image readImage(const std::string& path);

/// Metadata written by writePng or writeExr: value of "Command", empty if absent. Throws InputError.
std::string readImageCommand(const std::string& path);

}  // namespace freevoxel
