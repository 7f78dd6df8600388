#include "bench/fidelity/measured.h"

#include <fmt/core.h>

#include <algorithm>

namespace freevoxel::bench {

void Measured::add(const ImageDifference& difference) {
  squares_ += difference.rms * difference.rms * double(difference.coveredPixels);
  pixels_ += difference.coveredPixels;
  worst_ = std::min(worst_, difference.psnr);
}

double Measured::pooled() const {
  return squares_ > 0.0 ? -10.0 * std::log10(squares_ / double(pixels_)) : INFINITY;
}

std::string Measured::text() const {
  return pixels_ == 0 ? "-" : fmt::format("{:.1f} ({:.1f})", pooled(), worst());
}

}  // namespace freevoxel::bench
