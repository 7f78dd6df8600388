#include "base/compare.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.h"

namespace freevoxel {

namespace {

void checkComparable(const Image& a, const Image& b) {
  if (a.size != b.size || a.channels != b.channels) {
    throw InputError(fmt::format("cannot compare {} x {} pixels of {} channels with {} x {} of {}", a.size.x, a.size.y,
                                 a.channels, b.size.x, b.size.y, b.channels));
  }
}

double distance(float a, float b) {
  if (a == b) return 0.0;  // equal infinities included
  const double d = std::abs(double(a) - double(b));
  return std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
}

/// Rec. 709 weights; the first channel alone where there are fewer than three.
double luminance(const Image& image, const float* pixel) {
  if (image.channels < 3) return pixel[0];
  return 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2];
}

bool covers(const Image& image, size_t pixel) {
  const float* p = image.pixels.data() + pixel * size_t(image.channels);
  return std::any_of(p, p + image.channels, [](float c) { return c != 0.0f; });
}

/// Structural similarity (Wang et al. 2004) of one window with its upper left pixel at (x0, y0).
double windowSsim(const Image& a, const Image& b, int x0, int y0, int width, int height) {
  constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
  double sumA = 0.0, sumB = 0.0, sumAA = 0.0, sumBB = 0.0, sumAB = 0.0;
  for (int y = y0; y < y0 + height; ++y) {
    for (int x = x0; x < x0 + width; ++x) {
      const double la = luminance(a, a.at(x, y)), lb = luminance(b, b.at(x, y));
      sumA += la;
      sumB += lb;
      sumAA += la * la;
      sumBB += lb * lb;
      sumAB += la * lb;
    }
  }
  const double n = double(width) * height;
  const double meanA = sumA / n, meanB = sumB / n;
  const double varianceA = sumAA / n - meanA * meanA, varianceB = sumBB / n - meanB * meanB;
  const double covariance = sumAB / n - meanA * meanB;
  const double ssim = (2.0 * meanA * meanB + kC1) * (2.0 * covariance + kC2) /
                      ((meanA * meanA + meanB * meanB + kC1) * (varianceA + varianceB + kC2));
  return std::isfinite(ssim) ? ssim : 0.0;
}

/// Windows of 8 x 8 pixels at every fourth pixel, the last ones moved inwards to end at the border.
double meanSsim(const Image& a, const Image& b, const std::vector<bool>& covered) {
  constexpr int kWindow = 8, kStride = 4;
  const int width = std::min(kWindow, a.size.x), height = std::min(kWindow, a.size.y);
  double sum = 0.0;
  uint64_t windows = 0;
  for (int y = 0; y < a.size.y - height + kStride; y += kStride) {
    for (int x = 0; x < a.size.x - width + kStride; x += kStride) {
      const int x0 = std::min(x, a.size.x - width), y0 = std::min(y, a.size.y - height);
      bool touches = false;
      for (int row = y0; row < y0 + height && !touches; ++row) {
        const auto begin = covered.begin() + (ptrdiff_t(row) * a.size.x + x0);
        touches = std::find(begin, begin + width, true) != begin + width;
      }
      if (!touches) continue;
      sum += windowSsim(a, b, x0, y0, width, height);
      ++windows;
    }
  }
  return windows == 0 ? 1.0 : sum / double(windows);
}

}  // namespace

ImageDifference compareImages(const Image& a, const Image& b) {
  checkComparable(a, b);
  const size_t count = size_t(a.size.x) * size_t(a.size.y);
  const size_t channels = size_t(a.channels);
  const size_t colours = std::min<size_t>(3, channels);
  ImageDifference result;
  std::vector<bool> covered(count);
  double squares = 0.0;
  for (size_t i = 0; i < count; ++i) {
    covered[i] = covers(a, i) || covers(b, i);
    if (covered[i]) ++result.coveredPixels;
    for (size_t c = 0; c < channels; ++c) {
      const float& fa = a.pixels[i * channels + c];
      const float& fb = b.pixels[i * channels + c];
      unsigned char bytesA[sizeof(float)], bytesB[sizeof(float)];
      std::memcpy(bytesA, &fa, sizeof fa);
      std::memcpy(bytesB, &fb, sizeof fb);
      for (size_t k = 0; k < sizeof(float); ++k)
        result.differingBytes += bytesA[k] != bytesB[k];
      const double d = distance(fa, fb);
      result.maxError = std::max(result.maxError, d);
      if (c < colours) squares += d * d;  // uncovered pixels are zero in both
    }
  }
  result.identical = result.differingBytes == 0;
  if (result.coveredPixels > 0) result.rms = std::sqrt(squares / double(result.coveredPixels * colours));
  result.psnr = result.rms > 0.0 ? -20.0 * std::log10(result.rms) : std::numeric_limits<double>::infinity();
  result.ssim = meanSsim(a, b, covered);
  return result;
}

Image differenceImage(const Image& a, const Image& b, float gain) {
  checkComparable(a, b);
  Image picture(a.size, 4);
  const size_t count = size_t(a.size.x) * size_t(a.size.y);
  for (size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) {
      // Fewer than three channels show as grey.
      const size_t from = i * size_t(a.channels) + size_t(a.channels < 3 ? 0 : c);
      picture.pixels[4 * i + size_t(c)] = float(distance(a.pixels[from], b.pixels[from])) * gain;
    }
    picture.pixels[4 * i + 3] = 1.0f;
  }
  return picture;
}

}  // namespace freevoxel
