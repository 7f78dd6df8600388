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

HWY_INLINE Depths sum(Depths a, Depths b) {
  return hn::Min(hn::Add(a, b), hn::Set(Tag(), kLargestKeptDepth));
}

/// `depths` may be `next` less stepX.
HWY_INLINE void addRow(const FixedDepth* next, const FixedDepth* segments, int width, bool descending,
                       FixedDepth* depths) {
  const Tag tag;
  const auto lanes = ptrdiff_t(hn::Lanes(tag));
  if (descending) {
    for (ptrdiff_t x = width - lanes; x >= 0; x -= lanes)
      hn::StoreU(sum(hn::LoadU(tag, next + x), hn::LoadU(tag, segments + x)), tag, depths + x);
  } else {
    for (ptrdiff_t x = 0; x < width; x += lanes)
      hn::StoreU(sum(hn::LoadU(tag, next + x), hn::LoadU(tag, segments + x)), tag, depths + x);
  }
}

/// Running sum along a row, upwards in x or downwards.
template <bool kUp>
HWY_INLINE void addAlongRow(const FixedDepth* segments, int width, FixedDepth* depths) {
  const Tag tag;
  const auto lanes = ptrdiff_t(hn::Lanes(tag));
  // Lane i takes lane i -+ shift, for shifts 1, 2, 4 and 8, as far as there are lanes; 0 beyond.
  constexpr int kShifts = 4;
  HWY_ALIGN uint32_t from[kShifts + 1][kRowUnit] = {};
  HWY_ALIGN uint32_t inside[kShifts][kRowUnit] = {};
  for (ptrdiff_t i = 0; i < lanes; ++i) {
    for (int s = 0; s < kShifts; ++s) {
      const ptrdiff_t source = kUp ? i - (1 << s) : i + (1 << s);
      const bool valid = source >= 0 && source < lanes;
      from[s][i] = valid ? uint32_t(source) : 0;
      inside[s][i] = valid ? ~0u : 0;
    }
    from[kShifts][i] = kUp ? uint32_t(lanes - 1) : 0;
  }
  const auto shifted = [&](Depths v, int s) {
    return hn::And(hn::TableLookupLanes(v, hn::SetTableIndices(tag, from[s])), hn::Load(tag, inside[s]));
  };
  const auto last = hn::SetTableIndices(tag, from[kShifts]);
  Depths carry = hn::Zero(tag);
  for (ptrdiff_t i = 0; i < width; i += lanes) {
    const ptrdiff_t x = kUp ? i : width - lanes - i;
    Depths v = hn::LoadU(tag, segments + x);
    for (int s = 0; s < kShifts && (1 << s) < lanes; ++s)
      v = hn::Add(v, shifted(v, s));
    v = sum(v, carry);
    hn::StoreU(v, tag, depths + x);
    carry = hn::TableLookupLanes(v, last);
  }
}

void updateStripRows(const StripUpdate& u) {
  const bool upwards = u.samePlane ? u.stepY < 0 : u.stepY >= 0;
  for (int i = 0; i < u.rows; ++i) {
    // Between planes the state is renewed in place: the row that a row reads must not have been renewed yet. Within a
    // plane it must have been.
    const int y = upwards ? i : u.rows - 1 - i;
    const int nextY = y + u.stepY;
    FixedDepth* depths = u.state + size_t(y) * u.stride;
    const FixedDepth* segments = u.segments + size_t(y) * u.segmentStride;
    if (u.samePlane && u.stepY == 0) {
      if (u.stepX < 0) {
        addAlongRow<true>(segments, u.width, depths);
      } else {
        addAlongRow<false>(segments, u.width, depths);
      }
    } else {
      const FixedDepth* next = nextY >= 0 && nextY < u.rows ? u.state + size_t(nextY) * u.stride : u.upstream;
      if (next == nullptr) {
        std::fill_n(depths, u.width, 0);
        continue;
      }
      addRow(next + u.stepX, segments, u.width, u.stepX < 0, depths);
    }
    std::fill(depths + u.voxels, depths + u.width, 0);
  }
}

/// attenuationCode of four or more depths up to kLargestKeptDepth. Its powers differ in the last place, with and
/// without fused multiply-add; its codes do not, which a test shows for all of them.
HWY_INLINE Depths codesOf(Depths depths) {
  const Tag tag;
  const hn::RebindToSigned<Tag> integers;
  const hn::RebindToFloat<Tag> floats;
  const auto f = hn::ConvertTo(floats, hn::BitCast(integers, hn::And(depths, hn::Set(tag, 0x00ffff00))));
  const auto coefficient = [&](int i) {
    constexpr float kScale[5] = {1.0f, 0x1p-8f, 0x1p-16f, 0x1p-24f, 0x1p-32f};  // f is in units of 2^-24
    return hn::Set(floats, kExp2Coefficients[i] * kScale[i]);
  };
  auto power = hn::MulAdd(f, coefficient(4), coefficient(3));
  power = hn::MulAdd(f, power, coefficient(2));
  power = hn::MulAdd(f, power, coefficient(1));
  power = hn::MulAdd(f, power, coefficient(0));
  const auto exponent = hn::ShiftRight<1>(hn::And(depths, hn::Set(tag, 0x0f000000)));
  const auto code = hn::BitCast(floats, hn::Sub(hn::BitCast(tag, power), exponent));
  return hn::BitCast(tag, hn::NearestInt(code));
}

void codeStripRows(const FixedDepth* state, size_t stride, int rows, int width, const StripPart* parts,
                   size_t partCount, uint32_t* words) {
  const Tag tag;
  const auto lanes = int(hn::Lanes(tag));
  for (int y = 0; y < rows; y += 4) {
    const FixedDepth* row = state + size_t(y) * stride;
    uint32_t* out = words + size_t(y / 4) * size_t(width);
    for (size_t part = 0; part < partCount; ++part) {
      for (int x = parts[part].first; x < parts[part].last; x += lanes) {
        const Depths c0 = codesOf(hn::LoadU(tag, row + x));
        const Depths c1 = codesOf(hn::LoadU(tag, row + stride + x));
        const Depths c2 = codesOf(hn::LoadU(tag, row + 2 * stride + x));
        const Depths c3 = codesOf(hn::LoadU(tag, row + 3 * stride + x));
        const Depths lower = hn::Or(c0, hn::ShiftLeft<8>(c1));
        const Depths upper = hn::Or(c2, hn::ShiftLeft<8>(c3));
        hn::StoreU(hn::Or(lower, hn::ShiftLeft<16>(upper)), tag, out + x);
      }
    }
  }
}

#if HWY_TARGET == HWY_AVX3_DL

HWY_INLINE void storeRun(const uint32_t* words, size_t planeWords, const RunOrder& order, uint8_t* out) {
  __m512i run = _mm512_castsi128_si512(_mm_loadu_si128(reinterpret_cast<const __m128i*>(words)));
  run = _mm512_inserti32x4(run, _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + planeWords)), 1);
  run = _mm512_inserti32x4(run, _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + 2 * planeWords)), 2);
  run = _mm512_inserti32x4(run, _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + 3 * planeWords)), 3);
  const __m512i source = _mm512_load_si512(order.source.data());
  _mm512_stream_si512(reinterpret_cast<__m512i*>(out), _mm512_permutexvar_epi8(source, run));
}

#elif HWY_TARGET == HWY_SCALAR

HWY_INLINE void storeRun(const uint32_t* words, size_t planeWords, const RunOrder& order, uint8_t* out) {
  for (size_t step = 0; step < kRunVoxels; ++step) {
    const size_t place = order.source[step];
    out[step] = uint8_t(words[place / 16 * planeWords + place / 4 % 4] >> (8 * (place % 4)));
  }
}

#else

HWY_INLINE void storeRun(const uint32_t* words, size_t planeWords, const RunOrder& order, uint8_t* out) {
  const hn::FixedTag<uint8_t, 16> bytes;
  const hn::FixedTag<uint32_t, 4> four;
  const hn::FixedTag<uint64_t, 2> two;
  // A plane's 4 x 4 voxels as four groups of 2 x 2, group x / 2 * 2 + y / 2.
  alignas(16) static constexpr uint8_t kGroups[16] = {0, 1, 4, 5, 2, 3, 6, 7, 8, 9, 12, 13, 10, 11, 14, 15};
  const auto groups = hn::Load(bytes, kGroups);
  const auto plane = [&](size_t z) {
    return hn::BitCast(four, hn::TableLookupBytes(hn::BitCast(bytes, hn::LoadU(four, words + z * planeWords)), groups));
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

void storeBrickRuns(const uint32_t* words, size_t planeWords, int width, const BrickRun* runs, int runsPerEdge,
                    uint8_t* plane) {
  for (int y = 0; y < runsPerEdge; ++y) {
    for (int x = 0; x < runsPerEdge; ++x) {
      const BrickRun& run = runs[y * runsPerEdge + x];
      storeRun(words + size_t(y) * size_t(width) + size_t(x) * kRunEdge, planeWords, *run.order, plane + run.firstStep);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(updateStripRows);
HWY_EXPORT(codeStripRows);
HWY_EXPORT(storeBrickRuns);

void updateStrip(const StripUpdate& update) {
  HWY_DYNAMIC_DISPATCH(updateStripRows)(update);
}

void codeStrip(const FixedDepth* state, size_t stride, int rows, int width, std::span<const StripPart> parts,
               uint32_t* words) {
  HWY_DYNAMIC_DISPATCH(codeStripRows)(state, stride, rows, width, parts.data(), parts.size(), words);
}

void storeRuns(const uint32_t* words, size_t planeWords, int width, const BrickRun* runs, int runsPerEdge,
               uint8_t* plane) {
  HWY_DYNAMIC_DISPATCH(storeBrickRuns)(words, planeWords, width, runs, runsPerEdge, plane);
}

void finishStores() {
  hwy::FlushStream();
}

}  // namespace freevoxel
#endif
