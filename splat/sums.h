// The six sums of a pixel and what they become (DESIGN sections 3 and 4).
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "base/image.h"

namespace freevoxel {

/// How the sums turn into a picture.
enum class Formula {
  paper,       ///< nearest of the 26 directions, emission = opacity, plain sum (papers/freevoxels Eq. 11)
  direct,      ///< attenuation interpolated towards the eye, plain sum
  normalised,  ///< as direct, then scaled so that the pixel's opacity is exact (the default)
};

/// Channels of a sums image, also the channel names in --sums files.
inline constexpr int kSumChannels = 6;
const std::vector<std::string>& sumChannelNames();  ///< R G B O DepthHigh DepthLow

/// Six sums per pixel, every one a non-negative multiple of its quantum: S_rgb and S_o of `quantum`, depth high of
/// 1/64, depth low of 2^-16. Exact, whatever the order, as long as all are below 2^24 quanta, which sumsAreExact tells.
struct Sums {
  Image image;  ///< kSumChannels channels
  float quantum = 0.0f;
  float lightScale = 1.0f;  ///< S_rgb times this is radiance (colours are divided by it before they are summed)
};

/// What each channel of sums has to stay below: 2^24 quanta.
std::array<float, kSumChannels> exactLimits(float quantum);

/// Whether no sum reached 2^24 quanta. Contributions are not negative, so this proves every partial sum exact, in any
/// order and any reduction tree.
bool sumsAreExact(const Sums& sums);

/// The quantum to draw with after sums of `quantum` have not proved exact. Throws InputError if no quantum can help.
float nextQuantum(float quantum);

/// Premultiplied linear RGBA. alpha = 1 - exp(-S_d), except that for `paper` and `direct` alpha = min(S_o, 1).
Image resolve(const Sums& sums, Formula formula);

/// picture + (1 - alpha) * background, alpha kept; background in linear RGB.
Image overBackground(const Image& picture, glm::vec3 linearBackground);

}  // namespace freevoxel
