// How far two pictures are apart.
#pragma once

#include <cstdint>

#include "base/image.h"

namespace freevoxel {

/// Linear radiance over pixels that either image covers (any channel not zero); peak 1.
struct ImageDifference {
  bool identical = false;       ///< same size, channels and bits
  uint64_t differingBytes = 0;  ///< of the float channels
  uint64_t coveredPixels = 0;
  double rms = 0.0;       ///< over the colour channels (first three) of covered pixels
  double maxError = 0.0;  ///< largest absolute difference over all channels
  double psnr = 0.0;      ///< dB, peak 1; infinity if rms is 0
  double ssim = 0.0;      ///< mean structural similarity of luminance, 8x8 windows that touch a covered pixel
};

/// Throws InputError if sizes or channel counts differ. A NaN in either image counts as a difference of infinity.
ImageDifference compareImages(const Image& a, const Image& b);

/// Absolute difference, scaled by `gain`, as an opaque picture.
Image differenceImage(const Image& a, const Image& b, float gain);

}  // namespace freevoxel
