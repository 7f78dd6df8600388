#include "splat/sums.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "shaders/shared/quantum.h"

namespace freevoxel {

namespace {

/// S_rgb is scaled up to the exact opacity by no more than this: beyond it the sums hold nothing but rounding.
constexpr float kLargestGain = 64.0f;

}  // namespace

const std::vector<std::string>& sumChannelNames() {
  static const std::vector<std::string> names = {"R", "G", "B", "O", "DepthHigh", "DepthLow"};
  return names;
}

std::array<float, kSumChannels> exactLimits(float quantum) {
  const float light = shared::kExactLimit * quantum;
  return {light,
          light,
          light,
          light,
          shared::kExactLimit * shared::kDepthHighUnit,
          shared::kExactLimit * shared::kDepthLowUnit};
}

bool sumsAreExact(const Sums& sums) {
  const std::array<float, kSumChannels> limits = exactLimits(sums.quantum);
  const std::vector<float>& values = sums.image.pixels;
  for (size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] < limits[i % kSumChannels])) return false;
  }
  return true;
}

float nextQuantum(float quantum) {
  // Light can be rounded more coarsely, but optical depth has fixed units.
  if (quantum > 1.0f) {
    throw InputError(
        "optical depth along a pixel is beyond 2^18, too opaque to be summed exactly; lower the opacities or raise "
        "referenceLength");
  }
  return 4.0f * quantum;
}

Image resolve(const Sums& sums, Formula formula) {
  checkEqual(sums.image.channels, kSumChannels, "channels of sums");
  Image picture(sums.image.size, 4);
  const int64_t pixels = int64_t(sums.image.size.x) * sums.image.size.y;
#pragma omp parallel for schedule(static)
  for (int64_t i = 0; i < pixels; ++i) {
    const float* sum = sums.image.pixels.data() + i * kSumChannels;
    float* out = picture.pixels.data() + i * 4;
    const float emitted = sum[3];
    float gain = sums.lightScale;
    if (formula == Formula::normalised) {
      out[3] = -std::expm1(-(sum[4] + sum[5]));
      gain = emitted > 0.0f ? gain * std::min(out[3] / emitted, kLargestGain) : 0.0f;
    } else {
      out[3] = std::min(emitted, 1.0f);
    }
    for (int channel = 0; channel < 3; ++channel)
      out[channel] = sum[channel] * gain;
  }
  return picture;
}

Image overBackground(const Image& picture, glm::vec3 linearBackground) {
  checkEqual(picture.channels, 4, "channels of a picture");
  Image result = picture;
  for (size_t i = 0; i < result.pixels.size(); i += 4) {
    const float through = 1.0f - result.pixels[i + 3];
    for (int channel = 0; channel < 3; ++channel)
      result.pixels[i + size_t(channel)] += through * linearBackground[channel];
  }
  return result;
}

}  // namespace freevoxel
