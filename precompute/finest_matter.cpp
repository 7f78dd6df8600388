#include "precompute/finest_matter.h"

#include <algorithm>

namespace freevoxel {

namespace {

constexpr uint32_t kPlacesPerCode = 64;
/// What fits the caches.
constexpr uint32_t kMostEntries = 1u << 16;

/// What lies a quarter of the way from b to either neighbour, times 4.
struct Quarters {
  uint32_t low, high;
};

inline Quarters quarters(uint32_t a, uint32_t b, uint32_t c) {
  return {3 * b + a, 3 * b + c};
}

}  // namespace

FinestMatter::FinestMatter(const TransferFunction& transfer, const ValueCoding& coding)
    : visibility_(transfer, coding), labels_(transfer.isLabels) {
  const uint32_t last = coding.largest * kPlacesPerCode;
  while (last >> shift_ >= kMostEntries)
    ++shift_;
  // Places are rounded to the nearest entry.
  for (uint32_t entry = 0; entry <= (last >> shift_) + 1; ++entry) {
    const double code = std::min(double(entry << shift_) / kPlacesPerCode, double(coding.largest));
    const Classified at = transfer.at(coding.decode(code));
    table_.push_back({at.linear * at.extinction, at.extinction});
  }
}

bool FinestMatter::ofEight(const Codes& codes, std::array<LevelMatter, 8>& matter) const {
  const auto [low, high] = std::minmax_element(codes.begin(), codes.end());
  if (!visibility_.between(*low, *high)) return false;
  const uint32_t half = shift_ == 0 ? 0 : 1u << (shift_ - 1);
  const auto at = [&](uint32_t place) -> const LevelMatter& { return table_[(place + half) >> shift_]; };
  if (*low == *high || labels_) {
    for (size_t i = 0; i < 8; ++i)
      matter[i] = at(codes[21 + (i & 1) + 4 * (i >> 1 & 1) + 16 * (i >> 2)] * kPlacesPerCode);
    return true;
  }
  // Axis by axis; a voxel's own pair of quarters along each.
  uint32_t alongX[4][4][4], alongY[4][4][4];  // [z][y][quarter]
  for (size_t z = 0; z < 4; ++z) {
    for (size_t y = 0; y < 4; ++y) {
      const uint16_t* row = codes.data() + 16 * z + 4 * y;
      const Quarters first = quarters(row[0], row[1], row[2]), second = quarters(row[1], row[2], row[3]);
      alongX[z][y][0] = first.low;
      alongX[z][y][1] = first.high;
      alongX[z][y][2] = second.low;
      alongX[z][y][3] = second.high;
    }
    for (size_t x = 0; x < 4; ++x) {
      const Quarters first = quarters(alongX[z][0][x], alongX[z][1][x], alongX[z][2][x]);
      const Quarters second = quarters(alongX[z][1][x], alongX[z][2][x], alongX[z][3][x]);
      alongY[z][0][x] = first.low;
      alongY[z][1][x] = first.high;
      alongY[z][2][x] = second.low;
      alongY[z][3][x] = second.high;
    }
  }
  matter.fill({});
  for (size_t y = 0; y < 4; ++y) {
    for (size_t x = 0; x < 4; ++x) {
      const Quarters first = quarters(alongY[0][y][x], alongY[1][y][x], alongY[2][y][x]);
      const Quarters second = quarters(alongY[1][y][x], alongY[2][y][x], alongY[3][y][x]);
      const uint32_t places[4] = {first.low, first.high, second.low, second.high};
      for (size_t z = 0; z < 4; ++z) {
        LevelMatter& to = matter[x / 2 + y / 2 * 2 + z / 2 * 4];
        const LevelMatter& here = at(places[z]);
        to.glow += 0.125f * here.glow;
        to.extinction += 0.125f * here.extinction;
      }
    }
  }
  return true;
}

}  // namespace freevoxel
