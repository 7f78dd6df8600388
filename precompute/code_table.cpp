#include "precompute/code_table.h"

#include <array>

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

constexpr size_t kCodesPerLine = 32;  // of the cache

#if HWY_TARGET == HWY_AVX3_DL

/// Entries of 64 codes at a time, byte by byte, from `bytes` as CodeTable has them. Returns how many codes of each row
/// are done.
size_t lookUpBytes(const uint8_t* bytes, const CodeRows& rows, uint32_t* out, size_t stride) {
  constexpr size_t kAtOnce = 2 * kCodesPerLine;
  // Interleaving leaves 4 entries of every 16 in one register: codes are exchanged so that these follow each other.
  alignas(64) static constexpr std::array<uint8_t, kAtOnce> kExchange = [] {
    std::array<uint8_t, kAtOnce> lowBytes{};
    for (size_t i = 0; i < kAtOnce; ++i)
      lowBytes[i] = uint8_t(2 * (i % 4 + 16 * (i / 4 % 4) + 4 * (i / 16)));
    return lowBytes;
  }();
  const __m512i exchange = _mm512_load_si512(kExchange.data());
  __m512i table[16];
  for (size_t i = 0; i < 16; ++i)
    table[i] = _mm512_loadu_si512(bytes + 64 * i);
  for (size_t row = 0; row < rows.count; ++row) {
    const uint16_t* const codes = rows.codes + row * rows.width;
    for (size_t done = 0; done + kAtOnce <= rows.width; done += kAtOnce) {
      __builtin_prefetch(codes + done + rows.ahead);
      __builtin_prefetch(codes + done + rows.ahead + kCodesPerLine);
      const __m512i index = _mm512_permutex2var_epi8(_mm512_loadu_si512(codes + done), exchange,
                                                     _mm512_loadu_si512(codes + done + kAtOnce / 2));
      const __mmask64 second = _mm512_movepi8_mask(index);
      const auto plane = [&](size_t b) {
        const __m512i below = _mm512_permutex2var_epi8(table[4 * b], index, table[4 * b + 1]);
        const __m512i above = _mm512_permutex2var_epi8(table[4 * b + 2], index, table[4 * b + 3]);
        return _mm512_mask_blend_epi8(second, below, above);
      };
      const __m512i b0 = plane(0), b1 = plane(1), b2 = plane(2), b3 = plane(3);
      const __m512i low0 = _mm512_unpacklo_epi8(b0, b1), low1 = _mm512_unpackhi_epi8(b0, b1);
      const __m512i high0 = _mm512_unpacklo_epi8(b2, b3), high1 = _mm512_unpackhi_epi8(b2, b3);
      uint32_t* const entries = out + row * stride + done;
      _mm512_storeu_si512(entries, _mm512_unpacklo_epi16(low0, high0));
      _mm512_storeu_si512(entries + 16, _mm512_unpackhi_epi16(low0, high0));
      _mm512_storeu_si512(entries + 32, _mm512_unpacklo_epi16(low1, high1));
      _mm512_storeu_si512(entries + 48, _mm512_unpackhi_epi16(low1, high1));
    }
  }
  return rows.width / kAtOnce * kAtOnce;
}

#else

size_t lookUpBytes(const uint8_t* /*bytes*/, const CodeRows& /*rows*/, uint32_t* /*out*/, size_t /*stride*/) {
  return 0;
}

#endif

/// `bytes` may be null.
void lookUpRows(const uint32_t* HWY_RESTRICT entries, const uint8_t* bytes, const CodeRows& rows, uint32_t* out,
                size_t stride) {
  const hn::ScalableTag<uint32_t> tag;
  const hn::RebindToSigned<decltype(tag)> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  const size_t done = bytes != nullptr ? lookUpBytes(bytes, rows, out, stride) : 0;
  if (done == rows.width) return;
  for (size_t row = 0; row < rows.count; ++row) {
    const uint16_t* HWY_RESTRICT codes = rows.codes + row * rows.width;
    uint32_t* HWY_RESTRICT found = out + row * stride;
    for (size_t line = done; line < rows.width; line += kCodesPerLine)
      __builtin_prefetch(codes + line + rows.ahead);
    size_t i = done;
    for (; i + hn::Lanes(tag) <= rows.width; i += hn::Lanes(tag)) {
      const auto index = hn::PromoteTo(integers, hn::LoadU(halves, codes + i));
      hn::StoreU(hn::GatherIndex(tag, entries, index), tag, found + i);
    }
    for (; i < rows.width; ++i)
      found[i] = entries[codes[i]];
  }
}

void convertRows(const CodeRows& rows, float* out, size_t stride) {
  const hn::ScalableTag<float> floats;
  const hn::RebindToSigned<decltype(floats)> integers;
  const hn::Rebind<uint16_t, decltype(integers)> halves;
  for (size_t row = 0; row < rows.count; ++row) {
    const uint16_t* HWY_RESTRICT codes = rows.codes + row * rows.width;
    float* HWY_RESTRICT converted = out + row * stride;
    size_t i = 0;
    for (; i + hn::Lanes(floats) <= rows.width; i += hn::Lanes(floats))
      hn::StoreU(hn::ConvertTo(floats, hn::PromoteTo(integers, hn::LoadU(halves, codes + i))), floats, converted + i);
    for (; i < rows.width; ++i)
      converted[i] = float(codes[i]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(lookUpRows);
HWY_EXPORT(convertRows);

void CodeTable::split() {
  if (bits_.size() > kByteCodes) return;
  bytes_.resize(sizeof(uint32_t) * kByteCodes);
  for (size_t code = 0; code < bits_.size(); ++code) {
    for (size_t b = 0; b < sizeof(uint32_t); ++b)
      bytes_[kByteCodes * b + code] = uint8_t(bits_[code] >> (8 * b));
  }
}

void CodeTable::lookUpBits(const CodeRows& rows, uint32_t* out, size_t stride) const {
  HWY_DYNAMIC_DISPATCH(lookUpRows)(bits_.data(), bytes_.empty() ? nullptr : bytes_.data(), rows, out, stride);
}

void codesAsFloats(const CodeRows& rows, float* out, size_t stride) {
  HWY_DYNAMIC_DISPATCH(convertRows)(rows, out, stride);
}

}  // namespace freevoxel
#endif
