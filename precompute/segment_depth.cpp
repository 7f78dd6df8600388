#include "precompute/segment_depth.h"

#include <cmath>
#include <vector>

namespace freevoxel {

namespace {

class VoxelSegments final : public SegmentDepth {
 public:
  VoxelSegments(const TransferFunction& transfer, const ValueCoding& coding) : depths_(coding.largest + 1) {
    for (uint32_t code = 0; code <= coding.largest; ++code) {
      depths_[code] = fixedDepth(transfer.extinctionAt(coding.decode(code)));
    }
  }

  void row(std::span<const uint16_t> codes, std::span<const uint16_t> nextCodes, FixedDepth* depths) const override {
    lookUpDepths(depths_.data(), nextCodes.data(), codes.size(), depths);
  }
  bool isOfNeighbourOnly() const override { return true; }

 private:
  std::vector<FixedDepth> depths_;
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

class PreintegratedSegments final : public SegmentDepth {
 public:
  PreintegratedSegments(const TransferFunction& transfer, const ValueCoding& coding)
      : integral_(extinctionIntegral(transfer, coding)), own_(coding.largest + 1) {
    for (uint32_t code = 0; code <= coding.largest; ++code) {
      own_[code] = fixedDepth(transfer.extinctionAt(coding.decode(code)));
    }
    if (coding.bytes() == 1) {
      pairs_.resize(256 * 256);
      for (size_t a = 0; a <= coding.largest; ++a) {
        for (size_t b = 0; b <= coding.largest; ++b)
          pairs_[a * 256 + b] = segment(a, b);
      }
      const auto clear = [&](size_t code) {
        for (size_t other = 0; other <= code; ++other)
          if (pairs_[code * 256 + other] != 0 || pairs_[other * 256 + code] != 0) return false;
        return true;
      };
      while (firstVisible_ <= coding.largest && clear(firstVisible_))
        ++firstVisible_;
    }
  }

  void row(std::span<const uint16_t> codes, std::span<const uint16_t> nextCodes, FixedDepth* depths) const override {
    if (!pairs_.empty()) {
      lookUpDepthPairs(pairs_.data(), codes.data(), nextCodes.data(), codes.size(), firstVisible_, depths);
    } else {
      for (size_t x = 0; x < codes.size(); ++x)
        depths[x] = segment(codes[x], nextCodes[x]);
    }
  }

 private:
  FixedDepth segment(size_t a, size_t b) const {
    if (a == b) return own_[a];
    return roundedDepth((integral_[b] - integral_[a]) / (double(b) - double(a)));
  }

  std::vector<double> integral_;
  std::vector<FixedDepth> own_;
  uint16_t firstVisible_ = 0;      ///< segments between codes below are 0
  std::vector<FixedDepth> pairs_;  ///< segment(a, b) at a * 256 + b, for codes of one byte
};

}  // namespace

std::unique_ptr<SegmentDepth> makeSegmentDepth(Classification classification, const TransferFunction& transfer,
                                               const ValueCoding& coding) {
  if (classification == Classification::voxel) return std::make_unique<VoxelSegments>(transfer, coding);
  return std::make_unique<PreintegratedSegments>(transfer, coding);
}

}  // namespace freevoxel
