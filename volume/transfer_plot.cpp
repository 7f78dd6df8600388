#include "volume/transfer_plot.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "base/error.h"

namespace freevoxel {

namespace {

/// Three by five pixels for each character, rows from the top, three bits each.
struct Glyph {
  char character;
  std::array<uint8_t, 5> rows;
};
constexpr std::array<Glyph, 14> kGlyphs{{{'0', {7, 5, 5, 5, 7}},
                                         {'1', {2, 6, 2, 2, 7}},
                                         {'2', {7, 1, 7, 4, 7}},
                                         {'3', {7, 1, 7, 1, 7}},
                                         {'4', {5, 5, 7, 1, 1}},
                                         {'5', {7, 4, 7, 1, 7}},
                                         {'6', {7, 4, 7, 5, 7}},
                                         {'7', {7, 1, 2, 2, 2}},
                                         {'8', {7, 5, 7, 5, 7}},
                                         {'9', {7, 5, 7, 1, 7}},
                                         {'-', {0, 0, 7, 0, 0}},
                                         {'+', {0, 2, 7, 2, 0}},
                                         {'.', {0, 0, 0, 0, 2}},
                                         {'e', {3, 5, 7, 4, 3}}}};
constexpr int kScale = 2;
constexpr int kAdvance = 4 * kScale;

class Plot {
 public:
  explicit Plot(glm::ivec2 size) : image_(size, 4) {}

  /// sRGB over what is there.
  void blend(int x, int y, glm::dvec3 srgb, double alpha) {
    if (x < 0 || y < 0 || x >= image_.size.x || y >= image_.size.y) return;
    float* pixel = image_.at(x, y);
    for (int c = 0; c < 3; ++c)
      pixel[c] = std::lerp(pixel[c], linearFromSrgb(float(srgb[c])), float(alpha));
    pixel[3] = 1.0f;
  }
  void fill(glm::ivec2 from, glm::ivec2 to, glm::dvec3 srgb) {
    for (int y = from.y; y < to.y; ++y) {
      for (int x = from.x; x < to.x; ++x)
        blend(x, y, srgb, 1.0);
    }
  }
  /// Its middle at x, or as near as the picture allows.
  void text(int middle, int top, std::string_view words) {
    const int width = int(words.size()) * kAdvance - kScale;
    int x = std::clamp(middle - width / 2, 2, std::max(2, image_.size.x - width - 2));
    for (const char c : words) {
      const auto glyph = std::find_if(kGlyphs.begin(), kGlyphs.end(), [c](const Glyph& g) { return g.character == c; });
      for (int row = 0; glyph != kGlyphs.end() && row < 5; ++row) {
        for (int column = 0; column < 3; ++column) {
          if ((glyph->rows[size_t(row)] >> (2 - column) & 1) == 0) continue;
          const glm::ivec2 at(x + column * kScale, top + row * kScale);
          fill(at, at + kScale, glm::dvec3(0.75));
        }
      }
      x += kAdvance;
    }
  }
  Image take() { return std::move(image_); }

 private:
  Image image_;
};

/// A round distance between ticks, so that `extent` has some five.
double tickStep(double extent) {
  const double power = std::pow(10.0, std::floor(std::log10(extent / 5.0)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (extent / (factor * power) <= 6.0) return factor * power;
  }
  return 10.0 * power;
}

}  // namespace

Image transferPlot(const TransferFunction& transfer, const Histogram& histogram, glm::ivec2 size) {
  check(size.x >= 200 && size.y >= 120, "a plot of a transfer function has room for its parts");
  constexpr int kMargin = 16, kStrip = 14, kLabels = 30;
  const glm::dvec3 paper(0.09, 0.1, 0.12), grid(0.2, 0.21, 0.24), bar(0.38, 0.4, 0.44), curve(0.97, 0.97, 0.97);
  const int left = kMargin, right = size.x - kMargin;
  const int top = kMargin, bottom = size.y - kLabels - kStrip - 6;
  Plot plot(size);
  plot.fill({0, 0}, size, paper);
  const auto valueAt = [&](int x) {
    return std::lerp(transfer.low, transfer.high, (double(x - left) + 0.5) / double(right - left));
  };
  const auto heightOf = [&](double share) { return bottom - int(std::lround(share * double(bottom - top))); };

  for (const double share : {0.25, 0.5, 0.75, 1.0})
    plot.fill({left, heightOf(share)}, {right, heightOf(share) + 1}, grid);
  const uint64_t most = *std::max_element(histogram.counts.begin(), histogram.counts.end());
  for (int x = left; x < right && most > 0; ++x) {
    const double part = std::floor((valueAt(x) - histogram.low) / std::max(histogram.width(), 1e-300));
    if (!(part >= 0.0 && part < double(histogram.counts.size()))) continue;
    const double share = std::log1p(double(histogram.counts[size_t(part)])) / std::log1p(double(most));
    plot.fill({x, heightOf(share)}, {x + 1, bottom}, bar);
  }
  int before = heightOf(transfer.opacityAt(valueAt(left)));
  for (int x = left; x < right; ++x) {
    const double value = valueAt(x);
    const glm::dvec3 srgb = transfer.srgbAt(value);
    const int height = heightOf(transfer.opacityAt(value));
    for (int y = height; y < bottom; ++y)
      plot.blend(x, y, srgb, 0.55);
    plot.fill({x, std::min(before, height) - 1}, {x + 1, std::max(before, height) + 1}, curve);
    plot.fill({x, bottom + 4}, {x + 1, bottom + 4 + kStrip}, srgb);
    before = height;
  }
  const double extent = transfer.high - transfer.low;
  const double step = std::isfinite(extent) ? tickStep(extent) : 0.0;
  for (int i = 0; step > 0.0 && i < 10; ++i) {
    const double value = (std::ceil(transfer.low / step) + i) * step;
    if (value > transfer.high) break;
    const int x = left + int((value - transfer.low) / extent * double(right - left));
    plot.fill({x, bottom + 4 + kStrip}, {x + 1, bottom + 9 + kStrip}, glm::dvec3(0.75));
    plot.text(x, bottom + 13 + kStrip, fmt::format("{:.4g}", std::abs(value) < 1e-9 * step ? 0.0 : value));
  }
  return plot.take();
}

}  // namespace freevoxel
