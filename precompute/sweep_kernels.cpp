#include "precompute/sweep_kernels.h"

#include <algorithm>
#include <cstring>

// Permutes 64 bytes at once where there is an instruction for it.
#define HWY_WANT_AVX3_DL
// Highway compiles this file once for every instruction set and chooses when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "precompute/sweep_kernels.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace freevoxel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<uint32_t, kRowUnit>;
using Depths = hn::Vec<Tag>;

HWY_INLINE Depths kept(Depths depths) {
  return hn::Min(depths, hn::Set(Tag(), kLargestKeptDepth));
}

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3

HWY_INLINE Depths meanOrOwn(hn::Vec<hn::RebindToFloat<Tag>> integral, hn::Vec<hn::RebindToFloat<Tag>> codes,
                            Depths own) {
  const __mmask16 differ = _mm512_cmp_ps_mask(codes.raw, _mm512_setzero_ps(), _CMP_NEQ_OQ);
  const __m512 mean = _mm512_maskz_div_ps(differ, integral.raw, codes.raw);
  return Depths{_mm512_mask_cvtps_epi32(own.raw, differ, mean)};
}

#else

template <class Floats>
HWY_INLINE Depths meanOrOwn(Floats integral, Floats codes, Depths own) {
  const hn::RebindToFloat<Tag> floats;
  const auto differ = hn::Gt(hn::Mul(codes, codes), hn::Zero(floats));
  const auto mean = hn::Div(integral, hn::IfThenElse(differ, codes, hn::Set(floats, 1.0f)));
  return hn::IfThenElse(hn::RebindMask(Tag(), differ), hn::BitCast(Tag(), hn::NearestInt(mean)), own);
}

#endif

#if HWY_ARCH_X86 && HWY_TARGET <= HWY_SSE4

#if HWY_TARGET <= HWY_AVX3
HWY_INLINE __m512i packed32(__m512i a, __m512i b) {
  return _mm512_packus_epi32(a, b);
}
HWY_INLINE __m512i packed16(__m512i a, __m512i b) {
  return _mm512_packus_epi16(a, b);
}
#elif HWY_TARGET == HWY_AVX2
HWY_INLINE __m256i packed32(__m256i a, __m256i b) {
  return _mm256_packus_epi32(a, b);
}
HWY_INLINE __m256i packed16(__m256i a, __m256i b) {
  return _mm256_packus_epi16(a, b);
}
#else
HWY_INLINE __m128i packed32(__m128i a, __m128i b) {
  return _mm_packus_epi32(a, b);
}
HWY_INLINE __m128i packed16(__m128i a, __m128i b) {
  return _mm_packus_epi16(a, b);
}
#endif

using WordTag = hn::Repartition<uint16_t, Tag>;
using Words = hn::Vec<WordTag>;

/// attenuationCode of depths in units of 2^-12 log2.
HWY_INLINE Words codesOf(Words coded) {
  const WordTag words;
  const hn::RebindToSigned<WordTag> numbers;
  const auto coefficient = [&](int i) { return hn::Set(numbers, kExp2Coefficients[i]); };
  const auto f = hn::BitCast(numbers, hn::And(hn::ShiftLeft<3>(coded), hn::Set(words, 0x7ff8)));
  auto power = hn::Sub(coefficient(2), hn::MulFixedPoint15(f, coefficient(3)));
  power = hn::Sub(coefficient(1), hn::MulFixedPoint15(f, power));
  power = hn::Sub(coefficient(0), hn::MulFixedPoint15(f, power));
  const auto whole = hn::ShiftRight<12>(coded);
#if HWY_TARGET <= HWY_AVX3
  // 2^(8 - whole): the product is the power shifted and rounded.
  alignas(64) static constexpr int16_t kScales[32] = {256, 128, 64, 32, 16, 8, 4, 2, 1};
  static_assert(kExp2FractionBits == 7);
  const hn::Vec<hn::RebindToSigned<WordTag>> scales{_mm512_permutexvar_epi16(whole.raw, _mm512_load_si512(kScales))};
  return hn::BitCast(words, hn::MulFixedPoint15(power, scales));
#else
  const auto half = hn::Set(words, 1u << (kExp2FractionBits - 1));
  return hn::ShiftRight<kExp2FractionBits>(hn::Add(hn::BitCast(words, power) >> whole, half));
#endif
}

/// Bytes of four rows at x, as TilePlane::bytes has them.
HWY_INLINE void codeRows(const Depths (&rows)[kRunEdge], ptrdiff_t x, uint8_t* bytes) {
  const hn::Repartition<uint8_t, Tag> tag;
  const auto pair = [&](Depths a, Depths b) {
    return codesOf(Words{packed32(hn::ShiftRight<12>(a).raw, hn::ShiftRight<12>(b).raw)});
  };
  const hn::Vec<decltype(tag)> codes{packed16(pair(rows[0], rows[1]).raw, pair(rows[2], rows[3]).raw)};
  hn::StoreU(codes, tag, bytes + kRunEdge * x);
}

#else

HWY_INLINE void codeRows(const Depths (&rows)[kRunEdge], ptrdiff_t x, uint8_t* bytes) {
  const Tag tag;
  HWY_ALIGN FixedDepth depths[kRowUnit];
  for (int row = 0; row < kRunEdge; ++row) {
    hn::Store(rows[row], tag, depths);
    for (ptrdiff_t i = 0; i < ptrdiff_t(hn::Lanes(tag)); ++i)
      bytes[kRunEdge * ((x + i) & ~ptrdiff_t(3)) + 4 * row + ((x + i) & 3)] = attenuationCode(depths[i]);
  }
}

#endif

/// What four rows hold at x, one register each.
using FourRows = Depths[kRunEdge];

/// Lane i is lane i + 1 of `here`, the last one lane 0 of `beside`; or the other way round if `step` is -1.
template <int step>
HWY_INLINE Depths shifted(Depths here, Depths beside) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return Depths{step > 0 ? _mm512_alignr_epi32(beside.raw, here.raw, 1)
                         : _mm512_alignr_epi32(here.raw, beside.raw, 15)};
#else
  const Tag tag;
  const size_t lanes = hn::Lanes(tag);
  HWY_ALIGN uint32_t both[2 * kRowUnit];
  hn::Store(step > 0 ? here : beside, tag, both);
  hn::Store(step > 0 ? beside : here, tag, both + lanes);
  return hn::LoadU(tag, both + (step > 0 ? 1 : lanes - 1));
#endif
}

/// Sums of a lane and all those before it (kUp) or behind it.
template <bool kUp>
HWY_INLINE Depths runningSum(Depths v) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  const __m512i zero = _mm512_setzero_si512();
  const auto add = [&](__m512i moved) { v = Depths{_mm512_add_epi32(v.raw, moved)}; };
  add(kUp ? _mm512_alignr_epi32(v.raw, zero, 15) : _mm512_alignr_epi32(zero, v.raw, 1));
  add(kUp ? _mm512_alignr_epi32(v.raw, zero, 14) : _mm512_alignr_epi32(zero, v.raw, 2));
  add(kUp ? _mm512_alignr_epi32(v.raw, zero, 12) : _mm512_alignr_epi32(zero, v.raw, 4));
  add(kUp ? _mm512_alignr_epi32(v.raw, zero, 8) : _mm512_alignr_epi32(zero, v.raw, 8));
  return v;
#else
  const Tag tag;
  const size_t lanes = hn::Lanes(tag);
  HWY_ALIGN uint32_t padded[3 * kRowUnit] = {};
  for (size_t shift = 1; shift < lanes; shift *= 2) {
    hn::Store(v, tag, padded + lanes);
    v = hn::Add(v, hn::LoadU(tag, padded + (kUp ? lanes - shift : lanes + shift)));
  }
  return v;
#endif
}

/// The last lane (kUp) or the first one, in all lanes.
template <bool kUp>
HWY_INLINE Depths lastOf(Depths v) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX3
  return Depths{_mm512_permutexvar_epi32(_mm512_set1_epi32(kUp ? 15 : 0), v.raw)};
#else
  const Tag tag;
  HWY_ALIGN uint32_t lanes[kRowUnit];
  hn::Store(v, tag, lanes);
  return hn::Set(tag, lanes[kUp ? hn::Lanes(tag) - 1 : 0]);
#endif
}

/// Terms of a vector of voxels in four rows, and of their neighbours. Moves along the rows.
template <SegmentRule rule>
class TermsAt {
 public:
  HWY_INLINE TermsAt(const Tile& tile, const TilePlane& plane, ptrdiff_t x)
      : stride_(ptrdiff_t(tile.stride)), own_(tile.terms.own + plane.own + x) {
    if constexpr (rule != SegmentRule::neighbour) {
      const ptrdiff_t own = plane.own + x, neighbour = plane.neighbour + x;
      code_ = tile.terms.code + own;
      high_ = tile.terms.high + own;
      nextCode_ = tile.terms.code + neighbour;
      nextHigh_ = tile.terms.high + neighbour;
      if constexpr (rule == SegmentRule::splitIntegral) {
        low_ = tile.terms.low + own;
        nextLow_ = tile.terms.low + neighbour;
      }
    }
  }

  HWY_INLINE Depths own(ptrdiff_t row) const { return hn::LoadU(Tag(), own_ + row * stride_); }
  /// Segments to the neighbours, 0 if either lies outside the volume.
  HWY_INLINE Depths segments(ptrdiff_t row) const {
    const ptrdiff_t at = row * stride_;
    auto integral = difference(nextHigh_ + at, high_ + at);
    if constexpr (rule == SegmentRule::splitIntegral)
      integral = hn::Add(integral, difference(nextLow_ + at, low_ + at));
    return meanOrOwn(integral, difference(nextCode_ + at, code_ + at), own(row));
  }
  HWY_INLINE void move(ptrdiff_t step) {
    own_ += step;
    if constexpr (rule != SegmentRule::neighbour) {
      code_ += step;
      high_ += step;
      nextCode_ += step;
      nextHigh_ += step;
    }
    if constexpr (rule == SegmentRule::splitIntegral) {
      low_ += step;
      nextLow_ += step;
    }
  }

 private:
  static HWY_INLINE hn::Vec<hn::RebindToFloat<Tag>> difference(const float* a, const float* b) {
    const hn::RebindToFloat<Tag> floats;
    return hn::Sub(hn::LoadU(floats, a), hn::LoadU(floats, b));
  }

  ptrdiff_t stride_;
  const FixedDepth* own_;
  const float *code_ = nullptr, *high_ = nullptr, *low_ = nullptr;
  const float *nextCode_ = nullptr, *nextHigh_ = nullptr, *nextLow_ = nullptr;
};

/// What neighbours further in see of a voxel: with the rule `neighbour` its depth and its own, else its depth.
template <SegmentRule rule>
HWY_INLINE Depths passedOn(Depths depths, const TermsAt<rule>& terms, ptrdiff_t row) {
  if constexpr (rule != SegmentRule::neighbour) return depths;
  return hn::Add(depths, terms.own(row));
}

/// Where the kernels are in the rows of a plane.
struct Along {
  HWY_INLINE Along(const Tile& tile, const TilePlane& plane, bool descending)
      : step(descending ? -ptrdiff_t(hn::Lanes(Tag())) : ptrdiff_t(hn::Lanes(Tag()))),
        vectors(tile.width / ptrdiff_t(hn::Lanes(Tag()))),
        x(descending ? tile.width - ptrdiff_t(hn::Lanes(Tag())) : 0),
        wanted(tile.wanted),
        bytes(plane.bytes) {}
  /// Depths of four rows are found.
  HWY_INLINE void give(const FourRows& rows) {
    if (wanted[size_t(x) / kRowUnit] != 0) codeRows(rows, x, bytes);
    x += step;
  }
  ptrdiff_t step, vectors, x;
  const uint8_t* wanted;
  uint8_t* bytes;
};

HWY_INLINE void storeDepths(const Tile& tile, const FourRows& rows, ptrdiff_t x) {
  for (size_t row = 0; row < kRunEdge; ++row)
    hn::StoreU(rows[row], Tag(), tile.depths + row * tile.stride + x);
}

/// Bytes of a plane whose depths are there.
HWY_INLINE void codeDepths(const Tile& tile, const TilePlane& plane, const FixedDepth* depths) {
  const auto stride = ptrdiff_t(tile.stride);
  Along along(tile, plane, false);
  for (ptrdiff_t i = along.vectors; i > 0; --i) {
    FourRows rows;
    for (ptrdiff_t row = 0; row < kRunEdge; ++row)
      rows[row] = hn::LoadU(Tag(), depths + along.x + row * stride);
    along.give(rows);
  }
}

enum class Kept {
  whole,     ///< state is passed on as it is
  cut,       ///< it is cut
  cutDepths  ///< it is cut, and depths are wanted
};

/// One plane from the plane before, in place: from the neighbour after upwards in x, from the one before downwards.
template <SegmentRule rule, int stepY, Kept keep>
HWY_INLINE void renewPlane(const Tile& tile, const TilePlane& plane) {
  const Tag tag;
  Along along(tile, plane, tile.stepX < 0);
  TermsAt<rule> terms(tile, plane, along.x);
  const auto stride = ptrdiff_t(tile.stride);
  FixedDepth* state = tile.state + along.x;
  const FixedDepth* next = state + tile.stepX;
  const FixedDepth* beyond = stepY == 0 ? nullptr : plane.beyond + along.x + tile.stepX;
  FixedDepth* leaving = stepY == 0 ? nullptr : plane.leaving + along.x;
  for (ptrdiff_t i = along.vectors; i > 0; --i) {
    // All rows are read before one is written.
    FourRows rows;
    for (ptrdiff_t row = 0; row < kRunEdge; ++row) {
      const ptrdiff_t from = row + stepY;
      rows[row] = hn::LoadU(tag, from < 0 || from >= kRunEdge ? beyond : next + from * stride);
      if constexpr (rule != SegmentRule::neighbour) rows[row] = hn::Add(rows[row], terms.segments(row));
    }
    for (ptrdiff_t row = 0; row < kRunEdge; ++row) {
      Depths passed = passedOn<rule>(rows[row], terms, row);
      if constexpr (keep != Kept::whole) passed = kept(passed);
      hn::StoreU(passed, tag, state + row * stride);
      if (stepY != 0 && row == (stepY > 0 ? 0 : kRunEdge - 1)) hn::StoreU(passed, tag, leaving);
    }
    if constexpr (keep == Kept::cutDepths) storeDepths(tile, rows, along.x);
    along.give(rows);
    terms.move(along.step);
    state += along.step;
    next += along.step;
    if constexpr (stepY != 0) {
      beyond += along.step;
      leaving += along.step;
    }
  }
}

/// One plane in itself, row by row, against stepY; within a row against stepX.
template <SegmentRule rule, int stepX, int stepY>
HWY_INLINE void renewAcrossRows(const Tile& tile, const TilePlane& plane) {
  const Tag tag;
  Along along(tile, plane, stepX > 0);
  TermsAt<rule> terms(tile, plane, along.x);
  const FixedDepth* beyond = plane.beyond + along.x;
  FixedDepth* leaving = plane.leaving + along.x;
  // What the rows before passed on in the vector before. No array: that would not be kept in registers.
  Depths beside0 = hn::Zero(tag), beside1 = beside0, beside2 = beside0, beside3 = beside0;
  for (ptrdiff_t i = along.vectors; i > 0; --i) {
    FourRows rows;
    Depths passed = hn::LoadU(tag, beyond);
    const auto renewRow = [&](ptrdiff_t place, Depths& beside) HWY_ATTR {
      const ptrdiff_t row = stepY < 0 ? place : kRunEdge - 1 - place;
      Depths depths = passed;
      if constexpr (stepX != 0) depths = shifted<stepX>(passed, beside);
      beside = passed;
      if constexpr (rule != SegmentRule::neighbour) depths = hn::Add(depths, terms.segments(row));
      rows[row] = depths;
      passed = passedOn<rule>(depths, terms, row);
    };
    renewRow(0, beside0);
    renewRow(1, beside1);
    renewRow(2, beside2);
    renewRow(3, beside3);
    hn::StoreU(kept(passed), tag, leaving);
    if (tile.depthsWanted) storeDepths(tile, rows, along.x);
    along.give(rows);
    terms.move(along.step);
    beyond += along.step;
    leaving += along.step;
  }
}

/// One plane in itself, along rows, against stepX. Sums first, bytes then: both at once wait for each other.
template <SegmentRule rule, int stepX>
HWY_INLINE void renewAlongRows(const Tile& tile, const TilePlane& plane) {
  constexpr bool kUp = stepX < 0;
  const Tag tag;
  Along along(tile, plane, !kUp);
  TermsAt<rule> terms(tile, plane, along.x);
  const auto stride = ptrdiff_t(tile.stride);
  // With the rule `neighbour` a sum is the depth of the voxel behind.
  FixedDepth* depths = tile.depths + along.x - (rule == SegmentRule::neighbour ? stepX : 0);
  // The sum up to the vector before, in all lanes. No array: that would not be kept in registers.
  Depths before0 = hn::Zero(tag), before1 = before0, before2 = before0, before3 = before0;
  for (ptrdiff_t i = along.vectors; i > 0; --i) {
    const auto renewRow = [&](ptrdiff_t row, Depths& before) HWY_ATTR {
      const Depths v = rule == SegmentRule::neighbour ? terms.own(row) : terms.segments(row);
      const Depths sums = kept(hn::Add(runningSum<kUp>(v), before));
      hn::StoreU(sums, tag, depths + row * stride);
      before = lastOf<kUp>(sums);
    };
    renewRow(0, before0);
    renewRow(1, before1);
    renewRow(2, before2);
    renewRow(3, before3);
    terms.move(along.step);
    depths += along.step;
  }
  if (rule == SegmentRule::neighbour) {
    for (ptrdiff_t row = 0; row < kRunEdge; ++row)
      tile.depths[row * stride + (kUp ? 0 : tile.width - 1)] = 0;
  }
  codeDepths(tile, plane, tile.depths);
}

/// Nothing further out: depths are 0.
template <SegmentRule rule>
void clearPlane(const Tile& tile, const TilePlane& plane) {
  const Tag tag;
  Along along(tile, plane, false);
  TermsAt<rule> terms(tile, plane, 0);
  const FourRows rows = {hn::Zero(tag), hn::Zero(tag), hn::Zero(tag), hn::Zero(tag)};
  for (ptrdiff_t i = along.vectors; i > 0; --i) {
    for (ptrdiff_t row = 0; row < kRunEdge; ++row)
      hn::StoreU(passedOn<rule>(rows[row], terms, row), tag, tile.state + row * ptrdiff_t(tile.stride) + along.x);
    if (tile.depthsWanted) storeDepths(tile, rows, along.x);
    along.give(rows);
    terms.move(along.step);
  }
  if (tile.stepY != 0) {
    const size_t row = tile.stepY > 0 ? 0 : kRunEdge - 1;
    std::memcpy(plane.leaving, tile.state + row * tile.stride, size_t(tile.width) * sizeof(FixedDepth));
  }
}

template <SegmentRule rule, Kept keep>
void renewPlaneBy(const Tile& tile, const TilePlane& plane) {
  if (tile.stepY == 0) {
    renewPlane<rule, 0, keep>(tile, plane);
  } else {
    tile.stepY < 0 ? renewPlane<rule, -1, keep>(tile, plane) : renewPlane<rule, 1, keep>(tile, plane);
  }
}

template <SegmentRule rule, int stepY>
HWY_INLINE void renewAcrossRowsBy(const Tile& tile, const TilePlane& plane) {
  if (tile.stepX == 0) {
    renewAcrossRows<rule, 0, stepY>(tile, plane);
  } else {
    tile.stepX < 0 ? renewAcrossRows<rule, -1, stepY>(tile, plane) : renewAcrossRows<rule, 1, stepY>(tile, plane);
  }
}

template <SegmentRule rule>
void renewWithinPlane(const Tile& tile, const TilePlane& plane) {
  if (tile.stepY == 0) {
    tile.stepX < 0 ? renewAlongRows<rule, -1>(tile, plane) : renewAlongRows<rule, 1>(tile, plane);
  } else {
    tile.stepY < 0 ? renewAcrossRowsBy<rule, -1>(tile, plane) : renewAcrossRowsBy<rule, 1>(tile, plane);
  }
}

/// A row of three directions: entries of its voxels' terms and of their neighbours', and what comes in and goes out.
struct FanRow {
  const FixedDepth* own;
  const float *code, *high, *low, *nextCode, *nextHigh, *nextLow;
  const FixedDepth* in[kFanDirections];
  FixedDepth* out[kFanDirections];
};

/// `inPlace`: the rows that come in are those that go out.
template <SegmentRule rule, bool inPlace, bool cut>
HWY_INLINE void renewFanRow(const FanRow& row, ptrdiff_t width) {
  const Tag tag;
  const hn::RebindToFloat<Tag> floats;
  const FixedDepth *const own = row.own, *const in0 = row.in[0], *const in1 = row.in[1], *const in2 = row.in[2];
  const float *const code = row.code, *const high = row.high, *const low = row.low;
  const float *const nextCode = row.nextCode, *const nextHigh = row.nextHigh, *const nextLow = row.nextLow;
  FixedDepth *const out0 = row.out[0], *const out1 = row.out[1], *const out2 = row.out[2];
  Depths before = hn::Zero(tag);
  for (ptrdiff_t x = 0; x < width; x += ptrdiff_t(hn::Lanes(tag))) {
    const auto codes = hn::LoadU(floats, code + x), highs = hn::LoadU(floats, high + x);
    const Depths owns = hn::LoadU(tag, own + x);
    const auto segments = [&](ptrdiff_t stepX) HWY_ATTR {
      auto integral = hn::Sub(hn::LoadU(floats, nextHigh + x + stepX), highs);
      if constexpr (rule == SegmentRule::splitIntegral) {
        integral = hn::Add(integral, hn::Sub(hn::LoadU(floats, nextLow + x + stepX), hn::LoadU(floats, low + x)));
      }
      return meanOrOwn(integral, hn::Sub(hn::LoadU(floats, nextCode + x + stepX), codes), owns);
    };
    const auto store = [&](Depths depths, FixedDepth* out)
                           HWY_ATTR { hn::StoreU(cut ? kept(depths) : depths, tag, out + x); };
    Depths below;
    if constexpr (inPlace) {
      const Depths here = hn::LoadU(tag, in0 + x);
      below = shifted<-1>(here, before);
      before = here;
    } else {
      below = hn::LoadU(tag, in0 + x - 1);
    }
    const Depths level = hn::LoadU(tag, in1 + x), above = hn::LoadU(tag, in2 + x + 1);
    store(hn::Add(below, segments(-1)), out0);
    store(hn::Add(level, segments(0)), out1);
    store(hn::Add(above, segments(1)), out2);
  }
}

/// One plane along three directions, row by row: in place from the plane before, or in itself against stepY.
template <SegmentRule rule, int stepY, bool samePlane, bool cut>
void renewFanPlane(const Fan& fan, size_t plane) {
  const Tile& middle = *fan[1];
  const TilePlane& at = middle.planes[plane];
  const auto stride = ptrdiff_t(middle.stride);
  // A row comes after those that have yet to read it, or that it has to read.
  constexpr bool kAscending = samePlane ? stepY < 0 : stepY > 0;
  for (int place = 0; place < kRunEdge; ++place) {
    const int row = kAscending ? place : kRunEdge - 1 - place, from = row + stepY;
    const ptrdiff_t own = at.own + row * stride, neighbour = at.neighbour + row * stride;
    FanRow rows{};
    rows.own = middle.terms.own + own;
    rows.code = middle.terms.code + own;
    rows.high = middle.terms.high + own;
    rows.nextCode = middle.terms.code + neighbour;
    rows.nextHigh = middle.terms.high + neighbour;
    if constexpr (rule == SegmentRule::splitIntegral) {
      rows.low = middle.terms.low + own;
      rows.nextLow = middle.terms.low + neighbour;
    }
    for (size_t i = 0; i < kFanDirections; ++i) {
      FixedDepth* const first = samePlane ? fan[i]->depths : fan[i]->state;
      rows.in[i] = from < 0 || from >= kRunEdge ? fan[i]->planes[plane].beyond : first + from * stride;
      rows.out[i] = first + row * stride;
    }
    renewFanRow<rule, stepY == 0, cut>(rows, middle.width);
  }
  for (const Tile* tile : fan) {
    const FixedDepth* const first = samePlane ? tile->depths : tile->state;
    if constexpr (stepY != 0) {
      std::memcpy(tile->planes[plane].leaving, first + (stepY > 0 ? 0 : kRunEdge - 1) * stride,
                  size_t(tile->width) * sizeof(FixedDepth));
    }
    codeDepths(*tile, tile->planes[plane], first);
  }
}

template <SegmentRule rule, bool cut>
void renewFanBy(const Fan& fan, size_t plane) {
  if (fan[1]->stepY == 0) {
    renewFanPlane<rule, 0, false, cut>(fan, plane);
  } else {
    fan[1]->stepY < 0 ? renewFanPlane<rule, -1, false, cut>(fan, plane)
                      : renewFanPlane<rule, 1, false, cut>(fan, plane);
  }
}

template <SegmentRule rule>
void sweepFanBy(const Fan& fan) {
  const int planes = fan[1]->planeCount;
  for (int i = 0; i < planes; ++i) {
    const auto plane = size_t(i);
    if (fan[1]->planes[plane].neighbourOutside) {
      for (const Tile* tile : fan)
        clearPlane<rule>(*tile, tile->planes[plane]);
    } else if (fan[1]->samePlane) {
      fan[1]->stepY < 0 ? renewFanPlane<rule, -1, true, true>(fan, plane)
                        : renewFanPlane<rule, 1, true, true>(fan, plane);
    } else {
      i + 1 < planes ? renewFanBy<rule, false>(fan, plane) : renewFanBy<rule, true>(fan, plane);
    }
  }
}

void sweepFanRows(const Fan& fan) {
  fan[1]->rule == SegmentRule::integral ? sweepFanBy<SegmentRule::integral>(fan)
                                        : sweepFanBy<SegmentRule::splitIntegral>(fan);
}

template <SegmentRule rule>
void sweepTileBy(const Tile& tile) {
  for (int i = 0; i < tile.planeCount; ++i) {
    const TilePlane& plane = tile.planes[size_t(i)];
    if (plane.neighbourOutside) {
      clearPlane<rule>(tile, plane);
    } else if (tile.samePlane) {
      renewWithinPlane<rule>(tile, plane);
    } else if (tile.depthsWanted) {
      renewPlaneBy<rule, Kept::cutDepths>(tile, plane);
    } else if (i + 1 < tile.planeCount) {
      renewPlaneBy<rule, Kept::whole>(tile, plane);
    } else {
      renewPlaneBy<rule, Kept::cut>(tile, plane);
    }
  }
}

void sweepTileRows(const Tile& tile) {
  switch (tile.rule) {
    case SegmentRule::neighbour:
      return sweepTileBy<SegmentRule::neighbour>(tile);
    case SegmentRule::integral:
      return sweepTileBy<SegmentRule::integral>(tile);
    case SegmentRule::splitIntegral:
      return sweepTileBy<SegmentRule::splitIntegral>(tile);
  }
}

#if HWY_TARGET == HWY_SCALAR

HWY_INLINE void storeRun(const uint8_t* bytes, size_t planeBytes, const RunOrder& order, uint8_t* out) {
  for (size_t step = 0; step < kRunVoxels; ++step) {
    const size_t place = order.source[step];
    out[step] = bytes[place / 16 * planeBytes + place % 16];
  }
}

#else

HWY_INLINE void storeRun(const uint8_t* voxels, size_t planeBytes, const RunOrder& order, uint8_t* out) {
  const hn::FixedTag<uint8_t, 16> bytes;
  const hn::FixedTag<uint32_t, 4> four;
  const hn::FixedTag<uint64_t, 2> two;
  // A plane's 4 x 4 voxels as four groups of 2 x 2, group y / 2 * 2 + x / 2.
  alignas(16) static constexpr uint8_t kGroups[16] = {0, 1, 4, 5, 2, 3, 6, 7, 8, 9, 12, 13, 10, 11, 14, 15};
  const auto groups = hn::Load(bytes, kGroups);
  const auto plane = [&](size_t z) HWY_ATTR {
    return hn::BitCast(four, hn::TableLookupBytes(hn::LoadU(bytes, voxels + z * planeBytes), groups));
  };
  HWY_ALIGN uint64_t octants[8];
  for (size_t z = 0; z < 2; ++z) {
    const auto below = plane(2 * z), above = plane(2 * z + 1);
    hn::Store(hn::BitCast(two, hn::InterleaveLower(four, below, above)), two, octants + 4 * z);
    hn::Store(hn::BitCast(two, hn::InterleaveUpper(four, below, above)), two, octants + 4 * z + 2);
  }
  for (size_t pair = 0; pair < 4; ++pair) {
    HWY_ALIGN const uint64_t both[2] = {octants[order.octants[2 * pair]], octants[order.octants[2 * pair + 1]]};
    const auto within = hn::Load(bytes, order.within.data() + 16 * pair);
    hn::Stream(hn::TableLookupBytes(hn::BitCast(bytes, hn::Load(two, both)), within), bytes, out + 16 * pair);
  }
}

#endif

#if HWY_TARGET == HWY_AVX3_DL

/// Four runs beside each other along x.
HWY_INLINE void storeFourRuns(const uint8_t* bytes, size_t planeBytes, const BrickRun* runs, uint8_t* plane) {
  const auto load = [&](size_t z) { return _mm512_loadu_si512(bytes + z * planeBytes); };
  // Quarter x of register z becomes quarter z of register x.
  const __m512i z0 = load(0), z1 = load(1), z2 = load(2), z3 = load(3);
  const __m512i lower01 = _mm512_shuffle_i64x2(z0, z1, 0x44), upper01 = _mm512_shuffle_i64x2(z0, z1, 0xee);
  const __m512i lower23 = _mm512_shuffle_i64x2(z2, z3, 0x44), upper23 = _mm512_shuffle_i64x2(z2, z3, 0xee);
  const __m512i voxels[4] = {_mm512_shuffle_i64x2(lower01, lower23, 0x88), _mm512_shuffle_i64x2(lower01, lower23, 0xdd),
                             _mm512_shuffle_i64x2(upper01, upper23, 0x88),
                             _mm512_shuffle_i64x2(upper01, upper23, 0xdd)};
  for (size_t x = 0; x < 4; ++x) {
    const __m512i source = _mm512_load_si512(runs[x].order->source.data());
    _mm512_stream_si512(reinterpret_cast<__m512i*>(plane + runs[x].firstStep),
                        _mm512_permutexvar_epi8(source, voxels[x]));
  }
}

#endif

void storeBrickRuns(const uint8_t* bytes, size_t planeBytes, const BrickRow* bricks, size_t brickCount, size_t firstRun,
                    int runsPerEdge, size_t planeOffset) {
  for (size_t b = 0; b < brickCount; ++b) {
    const BrickRow& brick = bricks[b];
    const BrickRun* runs = brick.runs + firstRun;
    uint8_t* plane = brick.planes + planeOffset;
    int x = 0;
    const auto voxels = [&] { return bytes + size_t(kRunEdge) * size_t(brick.x + x * kRunEdge); };
#if HWY_TARGET == HWY_AVX3_DL
    for (; x + 4 <= runsPerEdge; x += 4)
      storeFourRuns(voxels(), planeBytes, runs + x, plane);
#endif
    for (; x < runsPerEdge; ++x)
      storeRun(voxels(), planeBytes, *runs[x].order, plane + runs[x].firstStep);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(sweepTileRows);
HWY_EXPORT(sweepFanRows);
HWY_EXPORT(storeBrickRuns);

void sweepTile(const Tile& tile) {
  HWY_DYNAMIC_DISPATCH(sweepTileRows)(tile);
}

void sweepFan(const Fan& fan) {
  HWY_DYNAMIC_DISPATCH(sweepFanRows)(fan);
}

void storeRuns(const uint8_t* bytes, size_t planeBytes, std::span<const BrickRow> bricks, size_t firstRun,
               int runsPerEdge, size_t planeOffset) {
  HWY_DYNAMIC_DISPATCH(storeBrickRuns)
  (bytes, planeBytes, bricks.data(), bricks.size(), firstRun, runsPerEdge, planeOffset);
}

void finishStores() {
  hwy::FlushStream();
}

}  // namespace freevoxel
#endif
