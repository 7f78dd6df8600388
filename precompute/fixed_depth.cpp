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

void lookUpRow(const FixedDepth* HWY_RESTRICT table, const uint16_t* HWY_RESTRICT codes, size_t count,
               FixedDepth* HWY_RESTRICT depths) {
  const hn::ScalableTag<uint32_t> tag;
  const hn::RebindToSigned<decltype(tag)> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  size_t i = 0;
  for (; i + hn::Lanes(tag) <= count; i += hn::Lanes(tag)) {
    const auto index = hn::PromoteTo(integers, hn::LoadU(halves, codes + i));
    hn::StoreU(hn::GatherIndex(tag, table, index), tag, depths + i);
  }
  for (; i < count; ++i)
    depths[i] = table[codes[i]];
}

void lookUpPairRow(const FixedDepth* HWY_RESTRICT table, const uint16_t* HWY_RESTRICT codes,
                   const uint16_t* HWY_RESTRICT nextCodes, size_t count, uint16_t firstVisible,
                   FixedDepth* HWY_RESTRICT depths) {
  const hn::ScalableTag<uint32_t> tag;
  const hn::RebindToSigned<decltype(tag)> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  const auto visible = hn::Set(integers, firstVisible);
  size_t i = 0;
  for (; i + hn::Lanes(tag) <= count; i += hn::Lanes(tag)) {
    const auto own = hn::PromoteTo(integers, hn::LoadU(halves, codes + i));
    const auto next = hn::PromoteTo(integers, hn::LoadU(halves, nextCodes + i));
    if (hn::AllTrue(integers, hn::Lt(hn::Max(own, next), visible))) {
      hn::StoreU(hn::Zero(tag), tag, depths + i);
    } else {
      hn::StoreU(hn::GatherIndex(tag, table, hn::Or(hn::ShiftLeft<8>(own), next)), tag, depths + i);
    }
  }
  for (; i < count; ++i)
    depths[i] = table[size_t(codes[i]) * 256 + nextCodes[i]];
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
                      uint16_t firstVisible, FixedDepth* depths) {
  HWY_DYNAMIC_DISPATCH(lookUpPairRow)(table, codes, nextCodes, count, firstVisible, depths);
}

}  // namespace freevoxel
#endif
