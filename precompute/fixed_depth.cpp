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

void addRow(const FixedDepth* HWY_RESTRICT next, const FixedDepth* HWY_RESTRICT segments, size_t count,
            FixedDepth* HWY_RESTRICT depths) {
  const hn::ScalableTag<uint32_t> tag;
  size_t i = 0;
  for (; i + hn::Lanes(tag) <= count; i += hn::Lanes(tag)) {
    const auto a = hn::LoadU(tag, next + i);
    const auto b = hn::LoadU(tag, segments + i);
    hn::StoreU(hn::Add(hn::Min(a, hn::Not(b)), b), tag, depths + i);
  }
  for (; i < count; ++i)
    depths[i] = saturatingSum(next[i], segments[i]);
}

/// attenuationCode, operation by operation.
void codeRow(const FixedDepth* HWY_RESTRICT depths, size_t count, uint8_t* HWY_RESTRICT codes) {
  const hn::ScalableTag<uint32_t> tag;
  const hn::RebindToSigned<decltype(tag)> integers;
  const hn::RebindToFloat<decltype(tag)> floats;
  const hn::Rebind<uint8_t, decltype(integers)> bytes;
  const auto c0 = hn::Set(floats, kExp2Coefficients[0]);
  const auto c1 = hn::Set(floats, kExp2Coefficients[1]);
  const auto c2 = hn::Set(floats, kExp2Coefficients[2]);
  const auto c3 = hn::Set(floats, kExp2Coefficients[3]);
  const auto c4 = hn::Set(floats, kExp2Coefficients[4]);
  size_t i = 0;
  for (; i + hn::Lanes(tag) <= count; i += hn::Lanes(tag)) {
    const auto wide = hn::BitCast(integers, hn::ShiftRight<8>(hn::LoadU(tag, depths + i)));
    const auto coded = hn::Min(wide, hn::Set(integers, kLargestCodedDepth));
    const auto f = hn::ConvertTo(floats, hn::And(coded, hn::Set(integers, 0xffff)));
    // Not MulAdd: rounding once where attenuationCode rounds twice would give other bytes.
    auto power = hn::Add(c3, hn::Mul(f, c4));
    power = hn::Add(c2, hn::Mul(f, power));
    power = hn::Add(c1, hn::Mul(f, power));
    power = hn::Add(c0, hn::Mul(f, power));
    const auto exponent = hn::ShiftLeft<23>(hn::ShiftRight<16>(coded));
    const auto code = hn::BitCast(floats, hn::Sub(hn::BitCast(integers, power), exponent));
    const auto rounded = hn::ConvertTo(integers, hn::Add(code, hn::Set(floats, 0.5f)));
    hn::StoreU(hn::DemoteTo(bytes, rounded), bytes, codes + i);
  }
  for (; i < count; ++i)
    codes[i] = attenuationCode(depths[i]);
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(addRow);
HWY_EXPORT(codeRow);

FixedDepth fixedDepth(double sigma) {
  return roundedDepth(sigma / std::log(2.0) * kDepthUnitsPerLog2);
}

void addDepths(const FixedDepth* next, const FixedDepth* segments, size_t count, FixedDepth* depths) {
  HWY_DYNAMIC_DISPATCH(addRow)(next, segments, count, depths);
}

void attenuationCodes(const FixedDepth* depths, size_t count, uint8_t* codes) {
  HWY_DYNAMIC_DISPATCH(codeRow)(depths, count, codes);
}

}  // namespace freevoxel
#endif
