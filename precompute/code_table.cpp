#include "precompute/code_table.h"

// Looks up 128 bytes at once where there is an instruction for it.
#define HWY_WANT_AVX3_DL
// Highway compiles this file once for every instruction set and chooses when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/code_table.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace freevoxel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_AVX3_DL

/// Entries of 64 codes at a time, byte by byte, from `bytes` as CodeTable has them. Returns how many codes are done.
size_t lookUpBytes(const uint8_t* bytes, const uint16_t* codes, size_t count, uint32_t* out) {
  constexpr size_t kAtOnce = 64;
  // Interleaving leaves 4 entries of every 16 in one register: codes are exchanged so that these follow each other.
  const __m512i exchange = _mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15);
  __m512i table[16];
  for (size_t i = 0; i < 16; ++i)
    table[i] = _mm512_loadu_si512(bytes + 64 * i);
  size_t done = 0;
  for (; done + kAtOnce <= count; done += kAtOnce) {
    const __m256i lower = _mm512_cvtepi16_epi8(_mm512_loadu_si512(codes + done));
    const __m256i upper = _mm512_cvtepi16_epi8(_mm512_loadu_si512(codes + done + kAtOnce / 2));
    const __m512i linear = _mm512_inserti64x4(_mm512_castsi256_si512(lower), upper, 1);
    const __m512i index = _mm512_permutexvar_epi32(exchange, linear);
    const __mmask64 second = _mm512_movepi8_mask(index);
    const auto plane = [&](size_t b) {
      const __m512i below = _mm512_permutex2var_epi8(table[4 * b], index, table[4 * b + 1]);
      const __m512i above = _mm512_permutex2var_epi8(table[4 * b + 2], index, table[4 * b + 3]);
      return _mm512_mask_blend_epi8(second, below, above);
    };
    const __m512i b0 = plane(0), b1 = plane(1), b2 = plane(2), b3 = plane(3);
    const __m512i low0 = _mm512_unpacklo_epi8(b0, b1), low1 = _mm512_unpackhi_epi8(b0, b1);
    const __m512i high0 = _mm512_unpacklo_epi8(b2, b3), high1 = _mm512_unpackhi_epi8(b2, b3);
    _mm512_storeu_si512(out + done, _mm512_unpacklo_epi16(low0, high0));
    _mm512_storeu_si512(out + done + 16, _mm512_unpackhi_epi16(low0, high0));
    _mm512_storeu_si512(out + done + 32, _mm512_unpacklo_epi16(low1, high1));
    _mm512_storeu_si512(out + done + 48, _mm512_unpackhi_epi16(low1, high1));
  }
  return done;
}

#else

size_t lookUpBytes(const uint8_t* /*bytes*/, const uint16_t* /*codes*/, size_t /*count*/, uint32_t* /*out*/) {
  return 0;
}

#endif

/// `bytes` may be null.
void lookUpCodes(const uint32_t* HWY_RESTRICT entries, const uint8_t* bytes, const uint16_t* HWY_RESTRICT codes,
                 size_t count, uint32_t* HWY_RESTRICT out) {
  const hn::ScalableTag<uint32_t> tag;
  const hn::RebindToSigned<decltype(tag)> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  size_t i = bytes != nullptr ? lookUpBytes(bytes, codes, count, out) : 0;
  for (; i + hn::Lanes(tag) <= count; i += hn::Lanes(tag)) {
    const auto index = hn::PromoteTo(integers, hn::LoadU(halves, codes + i));
    hn::StoreU(hn::GatherIndex(tag, entries, index), tag, out + i);
  }
  for (; i < count; ++i)
    out[i] = entries[codes[i]];
}

void convertCodes(const uint16_t* HWY_RESTRICT codes, size_t count, float* HWY_RESTRICT out) {
  const hn::ScalableTag<float> floats;
  const hn::RebindToSigned<decltype(floats)> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  size_t i = 0;
  for (; i + hn::Lanes(floats) <= count; i += hn::Lanes(floats))
    hn::StoreU(hn::ConvertTo(floats, hn::PromoteTo(integers, hn::LoadU(halves, codes + i))), floats, out + i);
  for (; i < count; ++i)
    out[i] = float(codes[i]);
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(lookUpCodes);
HWY_EXPORT(convertCodes);

void CodeTable::split() {
  if (bits_.size() > kByteCodes) return;
  bytes_.resize(sizeof(uint32_t) * kByteCodes);
  for (size_t code = 0; code < bits_.size(); ++code) {
    for (size_t b = 0; b < sizeof(uint32_t); ++b)
      bytes_[kByteCodes * b + code] = uint8_t(bits_[code] >> (8 * b));
  }
}

void CodeTable::lookUp(std::span<const uint16_t> codes, uint32_t* out) const {
  HWY_DYNAMIC_DISPATCH(lookUpCodes)
  (bits_.data(), bytes_.empty() ? nullptr : bytes_.data(), codes.data(), codes.size(), out);
}

void codesAsFloats(std::span<const uint16_t> codes, float* out) {
  HWY_DYNAMIC_DISPATCH(convertCodes)(codes.data(), codes.size(), out);
}

}  // namespace freevoxel
#endif
