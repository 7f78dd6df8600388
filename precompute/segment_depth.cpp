#include "precompute/segment_depth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace freevoxel {

namespace {

/// Depth of a segment between two voxels of every code.
std::vector<FixedDepth> ownDepths(const TransferFunction& transfer, const ValueCoding& coding) {
  std::vector<FixedDepth> depths(coding.largest + 1);
  for (uint32_t code = 0; code <= coding.largest; ++code)
    depths[code] = fixedDepth(transfer.extinctionAt(coding.decode(code)));
  return depths;
}

class VoxelSegments final : public SegmentDepth {
 public:
  VoxelSegments(const TransferFunction& transfer, const ValueCoding& coding) : own_(ownDepths(transfer, coding)) {}

  SegmentRule rule() const override { return SegmentRule::neighbour; }
  void terms(const CodeRows& codes, const MutableSegmentTerms& rows, size_t stride) const override {
    if (rows.own != nullptr) own_.lookUp(codes, rows.own, stride);
  }
  void row(std::span<const uint16_t> /*codes*/, std::span<const uint16_t> nextCodes,
           FixedDepth* depths) const override {
    own_.lookUp({nextCodes.data(), nextCodes.size(), 1}, depths, nextCodes.size());
  }

 private:
  CodeTable own_;
};

/// Integral of extinction over code from 0 to every code, in fixed-point units. Three Gauss points on each panel: exact
/// to rounding where extinction is smooth. Panels end at the transfer function's corners, inside which it is.
std::vector<double> extinctionIntegral(const TransferFunction& transfer, const ValueCoding& coding) {
  const int panels = coding.largest < 4096 ? 16 : 2;
  const double gauss = std::sqrt(0.6);
  std::vector<double> corners;
  for (const TransferPoint& point : transfer.points)
    corners.push_back(coding.position(point.value));
  std::vector<double> integral(coding.largest + 1);
  auto corner = corners.begin();
  for (uint32_t code = 0; code < coding.largest; ++code) {
    std::vector<double> ends{double(code)};
    for (; corner != corners.end() && *corner < code + 1.0; ++corner) {
      if (*corner > ends.back()) ends.push_back(*corner);
    }
    ends.push_back(code + 1.0);
    double sum = 0.0;
    for (size_t piece = 0; piece + 1 < ends.size(); ++piece) {
      const double half = 0.5 * (ends[piece + 1] - ends[piece]) / panels;
      for (int panel = 0; panel < panels; ++panel) {
        const double middle = ends[piece] + half * (2 * panel + 1);
        const auto extinction = [&](double at) { return transfer.extinctionAt(coding.decode(at)); };
        sum += half / 9.0 *
               (5.0 * extinction(middle - gauss * half) + 8.0 * extinction(middle) +
                5.0 * extinction(middle + gauss * half));
      }
    }
    integral[code + 1] = integral[code] + sum * kDepthUnitsPerLog2 / std::log(2.0);
  }
  return integral;
}

/// The integral as floats whose differences are those between codes. Of up to 256 codes one float is enough: its error
/// is up to 2^-25 of the whole integral, which is 256 mean extinctions. Of more, the upper half is cut so that its
/// differences are exact, and the lower half has the rest.
class PreintegratedSegments final : public SegmentDepth {
 public:
  PreintegratedSegments(const TransferFunction& transfer, const ValueCoding& coding)
      : split_(coding.bytes() > 1), ownDepths_(ownDepths(transfer, coding)), own_(ownDepths_) {
    const std::vector<double> integral = extinctionIntegral(transfer, coding);
    const double middle = 0.5 * integral.back();
    int exponent = 0;
    std::frexp(middle, &exponent);
    const double unit = std::ldexp(1.0, exponent - std::numeric_limits<float>::digits + 1);
    for (const double value : integral) {
      const double upper = split_ ? std::nearbyint((value - middle) / unit) * unit : value - middle;
      highs_.push_back(float(upper));
      if (split_) lows_.push_back(float(value - middle - upper));
    }
    high_ = CodeTable(highs_);
    low_ = CodeTable(lows_);
  }

  SegmentRule rule() const override { return split_ ? SegmentRule::splitIntegral : SegmentRule::integral; }

  void terms(const CodeRows& codes, const MutableSegmentTerms& rows, size_t stride) const override {
    if (rows.own != nullptr) own_.lookUp(codes, rows.own, stride);
    if (rows.code == nullptr) return;
    codesAsFloats(codes, rows.code, stride);
    high_.lookUp(codes, rows.high, stride);
    if (split_) low_.lookUp(codes, rows.low, stride);
  }

  void row(std::span<const uint16_t> codes, std::span<const uint16_t> nextCodes, FixedDepth* depths) const override {
    for (size_t x = 0; x < codes.size(); ++x)
      depths[x] = segment(codes[x], nextCodes[x]);
  }

 private:
  FixedDepth segment(uint16_t a, uint16_t b) const {
    if (a == b) return ownDepths_[a];
    float integral = highs_[b] - highs_[a];
    if (split_) integral += lows_[b] - lows_[a];
    return FixedDepth(std::lrint(integral / (float(b) - float(a))));
  }

  bool split_;
  std::vector<FixedDepth> ownDepths_;
  std::vector<float> highs_, lows_;
  CodeTable own_, high_, low_;
};

}  // namespace

std::unique_ptr<SegmentDepth> makeSegmentDepth(Classification classification, const TransferFunction& transfer,
                                               const ValueCoding& coding) {
  if (classification == Classification::voxel) return std::make_unique<VoxelSegments>(transfer, coding);
  return std::make_unique<PreintegratedSegments>(transfer, coding);
}

}  // namespace freevoxel
