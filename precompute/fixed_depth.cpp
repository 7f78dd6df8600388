#include "precompute/fixed_depth.h"

#include <cmath>

// Highway compiles this file once for every instruction set and chooses when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/fixed_depth.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace freevoxel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Whole vectors of look-ups; the rest one by one.
template <class Index, class IndexOf>
HWY_INLINE void lookUp(const FixedDepth* HWY_RESTRICT table, size_t count, const Index& vectorIndex,
                       const IndexOf& index, FixedDepth* HWY_RESTRICT depths) {
  const hn::ScalableTag<uint32_t> tag;
  size_t i = 0;
  for (; i + hn::Lanes(tag) <= count; i += hn::Lanes(tag))
    hn::StoreU(hn::GatherIndex(tag, table, vectorIndex(i)), tag, depths + i);
  for (; i < count; ++i)
    depths[i] = table[index(i)];
}

void lookUpRow(const FixedDepth* table, const uint16_t* codes, size_t count, FixedDepth* depths) {
  const hn::RebindToSigned<hn::ScalableTag<uint32_t>> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  lookUp(
      table, count, [&](size_t i) { return hn::PromoteTo(integers, hn::LoadU(halves, codes + i)); },
      [&](size_t i) { return codes[i]; }, depths);
}

void lookUpPairRow(const FixedDepth* table, const uint16_t* codes, const uint16_t* nextCodes, size_t count,
                   FixedDepth* depths) {
  const hn::RebindToSigned<hn::ScalableTag<uint32_t>> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  lookUp(
      table, count,
      [&](size_t i) {
        const auto pair = hn::Or(hn::ShiftLeft<8>(hn::LoadU(halves, codes + i)), hn::LoadU(halves, nextCodes + i));
        return hn::PromoteTo(integers, pair);
      },
      [&](size_t i) { return size_t(codes[i]) * 256 + nextCodes[i]; }, depths);
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(lookUpRow);
HWY_EXPORT(lookUpPairRow);

FixedDepth fixedDepth(double sigma) {
  return roundedDepth(sigma / std::log(2.0) * kDepthUnitsPerLog2);
}

void lookUpDepths(const FixedDepth* table, const uint16_t* codes, size_t count, FixedDepth* depths) {
  HWY_DYNAMIC_DISPATCH(lookUpRow)(table, codes, count, depths);
}

void lookUpDepthPairs(const FixedDepth* table, const uint16_t* codes, const uint16_t* nextCodes, size_t count,
                      FixedDepth* depths) {
  HWY_DYNAMIC_DISPATCH(lookUpPairRow)(table, codes, nextCodes, count, depths);
}

}  // namespace freevoxel
#endif
