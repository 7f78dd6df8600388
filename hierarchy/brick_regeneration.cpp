#include "hierarchy/brick_regeneration.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <mutex>
#include <numeric>

#include "base/error.h"
#include "precompute/brick_faces.h"
#include "precompute/hilbert.h"
#include "precompute/segment_depth.h"

// Highway compiles this file once for every instruction set and chooses when the program runs.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "hierarchy/brick_regeneration.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef FREEVOXEL_HIERARCHY_BRICK_REGENERATION
#define FREEVOXEL_HIERARCHY_BRICK_REGENERATION
namespace freevoxel {

/// Cells of 4^3 voxels are 64 consecutive steps of the curve, in one of twelve orders.
constexpr int kCellEdge = 4;
constexpr int kCellSlices = 4;        ///< along z
constexpr size_t kSliceBytes = 16;    ///< byte 4 x + y
constexpr uint8_t kNotHere = 0x80;    ///< in a shuffle: this byte comes from another slice
constexpr size_t kSlack = 64;         ///< floats that vectors may reach beyond a brick on either side
constexpr float kWholeCode = 255.0f;  ///< of attenuation 1

/// For every 16 bytes of a cell along the curve and every slice of the cell, where in the slice those bytes are.
struct CellShuffle {
  alignas(16) uint8_t index[kCellSlices][kCellSlices][kSliceBytes];
};

/// How the cells of a brick follow each other along the curve.
struct CellOrder {
  struct Cell {
    uint8_t x, y, z;
    uint8_t state;  ///< of the cell
  };
  std::vector<Cell> cells;
};

/// What the codes of a brick contribute to segments, voxels x fastest. Vectors have kSlack on either side.
struct BrickDepths {
  std::vector<float> code, own, integralHigh, integralLow;

  void resize(size_t voxels) {
    for (auto* floats : {&code, &own, &integralHigh, &integralLow})
      floats->resize(voxels + 2 * kSlack);
  }
};

/// A brick as it is swept along one direction: voxels x fastest, or for directions along x with x and y exchanged, so
/// that none depends on the voxel before in its row.
struct SweptDirection {
  int edge;
  glm::ivec3 extent;  ///< voxels inside the volume
  glm::ivec3 step;
  DirectionFaces shapes;
  const uint8_t* faces;
  /// The transmittance that takes voxel v + step to v is segments[v].
  const float* segments;
};

/// What a thread needs, kept from brick to brick. Floats have kSlack on either side.
struct RegenerationScratch {
  BrickDepths depths;
  std::vector<float> segments, exchangedSegments;
  std::vector<float> attenuations;  ///< 255 A of every voxel
  std::vector<uint8_t> slices;      ///< kSliceBytes of every slice of every cell, x fastest, then y, then z
};

}  // namespace freevoxel
#endif

HWY_BEFORE_NAMESPACE();
namespace freevoxel {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// 2^-depth for depths of 0..16, to 2^-22.
template <class D, class V>
V transmittance(D floats, V depth) {
  const hn::RebindToSigned<D> integers;
  const V exponent = hn::Neg(depth);
  const auto whole = hn::NearestInt(exponent);
  const V f = hn::Sub(exponent, hn::ConvertTo(floats, whole));
  // Interpolates (2^f - 1) / f at five Chebyshev nodes of -1/2..1/2: exact at 0.
  V power = hn::Set(floats, 0.00133813025f);
  power = hn::MulAdd(power, f, hn::Set(floats, 0.00966636852f));
  power = hn::MulAdd(power, f, hn::Set(floats, 0.0555038101f));
  power = hn::MulAdd(power, f, hn::Set(floats, 0.24022349f));
  power = hn::MulAdd(power, f, hn::Set(floats, 0.693147181f));
  power = hn::MulAdd(power, f, hn::Set(floats, 1.0f));
  return hn::BitCast(floats, hn::Add(hn::BitCast(integers, power), hn::ShiftLeft<23>(whole)));
}

/// Fills `depths` for voxels whose codes lie along the curve in `codes`, voxel v at steps[v].
template <class Code>
void spreadCodes(const Code* HWY_RESTRICT codes, const uint16_t* HWY_RESTRICT steps, size_t voxels,
                 const BrickRegeneration::CodeDepth* HWY_RESTRICT table, BrickDepths& depths) {
  float* HWY_RESTRICT code = depths.code.data() + kSlack;
  float* HWY_RESTRICT own = depths.own.data() + kSlack;
  float* HWY_RESTRICT high = depths.integralHigh.data() + kSlack;
  float* HWY_RESTRICT low = depths.integralLow.data() + kSlack;
#if HWY_TARGET == HWY_SCALAR
  for (size_t v = 0; v < voxels; ++v) {
    const BrickRegeneration::CodeDepth& depth = table[codes[steps[v]]];
    code[v] = depth.code;
    own[v] = depth.own;
    high[v] = depth.integralHigh;
    low[v] = depth.integralLow;
  }
#else
  // Four entries become four of each member.
  const hn::FixedTag<float, 4> floats;
  const hn::FixedTag<double, 2> pairs;
  const auto entry = [&](size_t v) { return hn::LoadU(floats, &table[codes[steps[v]]].code); };
  for (size_t v = 0; v < voxels; v += 4) {
    const auto a = entry(v), b = entry(v + 1), c = entry(v + 2), d = entry(v + 3);
    const auto lower = [&](auto one, auto two) { return hn::BitCast(pairs, hn::InterleaveLower(floats, one, two)); };
    const auto upper = [&](auto one, auto two) { return hn::BitCast(pairs, hn::InterleaveUpper(floats, one, two)); };
    const auto ab = lower(a, b), cd = lower(c, d), abUpper = upper(a, b), cdUpper = upper(c, d);
    hn::StoreU(hn::BitCast(floats, hn::InterleaveLower(pairs, ab, cd)), floats, code + v);
    hn::StoreU(hn::BitCast(floats, hn::InterleaveUpper(pairs, ab, cd)), floats, own + v);
    hn::StoreU(hn::BitCast(floats, hn::InterleaveLower(pairs, abUpper, cdUpper)), floats, high + v);
    hn::StoreU(hn::BitCast(floats, hn::InterleaveUpper(pairs, abUpper, cdUpper)), floats, low + v);
  }
#endif
}

void spreadBrick(const BrickRegeneration::Brick& brick, const uint16_t* steps, size_t voxels,
                 const BrickRegeneration::CodeDepth* table, BrickDepths& depths) {
  if (brick.bytesPerCode == 1) {
    spreadCodes(reinterpret_cast<const uint8_t*>(brick.codes.data()), steps, voxels, table, depths);
  } else {
    spreadCodes(reinterpret_cast<const uint16_t*>(brick.codes.data()), steps, voxels, table, depths);
  }
}

/// segments[v] = transmittance between v and v + offset, offset > 0, for all v where that lies in the brick.
void segmentRun(const BrickDepths& depths, size_t voxels, int offset, float* HWY_RESTRICT segments) {
  const hn::ScalableTag<float> floats;
  const size_t end = voxels - size_t(offset);
  const float* HWY_RESTRICT code = depths.code.data() + kSlack;
  const float* HWY_RESTRICT own = depths.own.data() + kSlack;
  const float* HWY_RESTRICT high = depths.integralHigh.data() + kSlack;
  const float* HWY_RESTRICT low = depths.integralLow.data() + kSlack;
  for (size_t v = 0; v < end; v += hn::Lanes(floats)) {
    const size_t next = v + size_t(offset);
    const auto codes = hn::Sub(hn::LoadU(floats, code + next), hn::LoadU(floats, code + v));
    const auto integral = hn::Add(hn::Sub(hn::LoadU(floats, high + next), hn::LoadU(floats, high + v)),
                                  hn::Sub(hn::LoadU(floats, low + next), hn::LoadU(floats, low + v)));
    const auto same = hn::Eq(codes, hn::Zero(floats));
    const auto mean = hn::Div(integral, hn::IfThenElse(same, hn::Set(floats, 1.0f), codes));
    hn::StoreU(transmittance(floats, hn::IfThenElse(same, hn::LoadU(floats, own + v), mean)), floats, segments + v);
  }
}

/// The row that the bytes of a face give.
template <class D>
void faceRow(D floats, const uint8_t* HWY_RESTRICT bytes, int edge, float* HWY_RESTRICT row) {
  const hn::RebindToSigned<D> integers;
  const hn::Rebind<uint8_t, D> narrow;
  for (size_t x = 0; x < size_t(edge); x += hn::Lanes(floats))
    hn::StoreU(hn::ConvertTo(floats, hn::PromoteTo(integers, hn::LoadU(narrow, bytes + x))), floats, row + x);
}

/// attenuations[v] = attenuations[v + step] * segments[v], from the faces inwards.
template <int edge>
void sweepRows(const SweptDirection& swept, float* attenuations) {
  const hn::CappedTag<float, std::min(edge, 16)> floats;
  const glm::ivec3 step = swept.step, extent = swept.extent;
  const int offset = step.x + edge * (step.y + edge * step.z);
  const int outerX = step.x > 0 ? edge - 1 : 0, outerY = step.y > 0 ? edge - 1 : 0, outerZ = step.z > 0 ? edge - 1 : 0;
  const int firstY = step.y < 0 ? 1 : 0, firstZ = step.z < 0 ? 1 : 0;
  const uint8_t* const acrossZ = swept.faces;
  const uint8_t* const acrossY = acrossZ + swept.shapes.acrossZ.bytes();
  const uint8_t* const acrossX = acrossY + swept.shapes.acrossY.bytes();
  const int widthX = swept.shapes.acrossX.width;
  const auto sweepRow = [&](int y, int z) {
    const int start = edge * (y + edge * z);
    float* row = attenuations + start;
    if (y >= extent.y || z >= extent.z) {
      std::fill_n(row, edge, kWholeCode);
      return;
    }
    if (step.z != 0 && z == outerZ) {
      faceRow(floats, acrossZ + edge * y, edge, row);
    } else if (step.y != 0 && y == outerY) {
      faceRow(floats, acrossY + edge * (z - firstZ), edge, row);
    } else if (y + step.y >= extent.y || z + step.z >= extent.z) {
      std::fill_n(row, edge, kWholeCode);
    } else {
      const float* next = row + offset;
      const float* segments = swept.segments + start;
      for (size_t x = 0; x < size_t(edge); x += hn::Lanes(floats))
        hn::StoreU(hn::Mul(hn::LoadU(floats, next + x), hn::LoadU(floats, segments + x)), floats, row + x);
      if (step.x != 0) row[outerX] = float(acrossX[(z - firstZ) * widthX + (y - firstY)]);
    }
    if (extent.x < edge) {
      const int inside = extent.x - (step.x > 0 ? 1 : 0);
      std::fill_n(row + inside, edge - inside, kWholeCode);
    }
  };
  // The outermost loop goes inwards; rows of the inner one do not depend on each other.
  for (int i = 0; i < edge; ++i) {
    const int inwards = (step.z != 0 ? step.z : step.y) < 0 ? i : edge - 1 - i;
    for (int j = 0; j < edge; ++j) {
      if (step.z != 0) {
        sweepRow(j, inwards);
      } else {
        sweepRow(inwards, j);
      }
    }
  }
}

void sweepBrick(const SweptDirection& swept, float* attenuations) {
  if (swept.edge == 8) return sweepRows<8>(swept, attenuations);
  if (swept.edge == 16) return sweepRows<16>(swept, attenuations);
  return sweepRows<32>(swept, attenuations);
}

/// Rounds to bytes: four rows become one row of slices, a lane the four bytes of ascending y.
template <class D>
void roundBrickRows(D floats, const float* HWY_RESTRICT attenuations, int edge, uint8_t* HWY_RESTRICT slices) {
  const hn::RebindToSigned<D> integers;
  const auto half = hn::Set(floats, 0.5f);
  const auto rounded = [&](const float* at) { return hn::ConvertTo(integers, hn::Add(hn::LoadU(floats, at), half)); };
  const size_t rows = size_t(edge) * size_t(edge);
  for (size_t row = 0; row < rows; row += kCellEdge) {
    const float* from = attenuations + row * size_t(edge);
    auto* to = reinterpret_cast<int32_t*>(slices + row * size_t(edge));
    for (size_t x = 0; x < size_t(edge); x += hn::Lanes(floats)) {
      const auto a = rounded(from + x), b = rounded(from + size_t(edge) + x);
      const auto c = rounded(from + 2 * size_t(edge) + x), d = rounded(from + 3 * size_t(edge) + x);
      const auto ab = hn::Or(a, hn::ShiftLeft<8>(b));
      const auto cd = hn::Or(hn::ShiftLeft<16>(c), hn::ShiftLeft<24>(d));
      hn::StoreU(hn::Or(ab, cd), integers, to + x);
    }
  }
}

/// One cell: the 64 bytes of four slices, `layer` bytes apart, into the curve's order.
void permuteCell(const uint8_t* HWY_RESTRICT slices, size_t layer, const CellShuffle& shuffle,
                 uint8_t* HWY_RESTRICT plane) {
#if HWY_TARGET == HWY_SCALAR
  for (size_t i = 0; i < kCellSlices * kSliceBytes; ++i) {
    for (size_t slice = 0; slice < kCellSlices; ++slice) {
      const uint8_t from = shuffle.index[i / kSliceBytes][slice][i % kSliceBytes];
      if (from != kNotHere) plane[i] = slices[slice * layer + from];
    }
  }
#else
  const hn::FixedTag<uint8_t, kSliceBytes> bytes;
  const auto a = hn::LoadU(bytes, slices), b = hn::LoadU(bytes, slices + layer);
  const auto c = hn::LoadU(bytes, slices + 2 * layer), d = hn::LoadU(bytes, slices + 3 * layer);
  for (size_t part = 0; part < kCellSlices; ++part) {
    const auto& index = shuffle.index[part];
    const auto ab = hn::Or(hn::TableLookupBytesOr0(a, hn::Load(bytes, index[0])),
                           hn::TableLookupBytesOr0(b, hn::Load(bytes, index[1])));
    const auto cd = hn::Or(hn::TableLookupBytesOr0(c, hn::Load(bytes, index[2])),
                           hn::TableLookupBytesOr0(d, hn::Load(bytes, index[3])));
    hn::StoreU(hn::Or(ab, cd), bytes, plane + part * kSliceBytes);
  }
#endif
}

/// Puts the voxels of every cell into the curve's order. `exchanged`: x and y are, in `slices`.
void permuteCells(const uint8_t* slices, int edge, const CellOrder& order, const CellShuffle* shuffles, bool exchanged,
                  uint8_t* plane) {
  const size_t cells = size_t(edge / kCellEdge);
  const size_t layer = cells * cells * kSliceBytes;
  for (const CellOrder::Cell& cell : order.cells) {
    const size_t x = exchanged ? cell.y : cell.x, y = exchanged ? cell.x : cell.y;
    const uint8_t* from = slices + ((size_t(cell.z) * kCellSlices * cells + y) * cells + x) * kSliceBytes;
    permuteCell(from, layer, shuffles[cell.state], plane);
    plane += kCellSlices * kSliceBytes;
  }
}

void storePlane(const float* attenuations, uint8_t* slices, int edge, const CellOrder& order,
                const CellShuffle* shuffles, bool exchanged, uint8_t* plane) {
  if (edge == 8) {
    roundBrickRows(hn::CappedTag<float, 8>(), attenuations, edge, slices);
  } else {
    roundBrickRows(hn::CappedTag<float, 16>(), attenuations, edge, slices);
  }
  permuteCells(slices, edge, order, shuffles, exchanged, plane);
}

}  // namespace HWY_NAMESPACE
}  // namespace freevoxel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace freevoxel {

HWY_EXPORT(spreadBrick);
HWY_EXPORT(segmentRun);
HWY_EXPORT(sweepBrick);
HWY_EXPORT(storePlane);

namespace {

constexpr int kLargestBrickOrder = 5;

using CellShuffles = std::array<CellShuffle, kHilbertStateCount>;

/// For cells whose slices hold byte 4 x + y, or if exchanged 4 y + x.
CellShuffles makeShuffles(bool exchanged) {
  CellShuffles shuffles{};
  for (int state = 0; state < kHilbertStateCount; ++state) {
    CellShuffle& shuffle = shuffles[size_t(state)];
    std::memset(shuffle.index, kNotHere, sizeof(shuffle.index));
    const auto curve = hilbertCurve(state, 2);
    for (size_t step = 0; step < curve.size(); ++step) {
      const LocalPosition p = curve[step];
      const int major = exchanged ? p.y : p.x, minor = exchanged ? p.x : p.y;
      shuffle.index[step / kSliceBytes][p.z][step % kSliceBytes] = uint8_t(kCellEdge * major + minor);
    }
  }
  return shuffles;
}

const CellShuffles& cellShuffles(bool exchanged) {
  static const CellShuffles plain = makeShuffles(false), swapped = makeShuffles(true);
  return exchanged ? swapped : plain;
}

/// The state in which the curve runs through the cell that holds these 64 steps.
uint8_t cellState(std::span<const LocalPosition> steps) {
  for (int state = 0; state < kHilbertStateCount; ++state) {
    const auto curve = hilbertCurve(state, 2);
    const bool same = std::equal(curve.begin(), curve.end(), steps.begin(), [](LocalPosition a, LocalPosition b) {
      return a.x == b.x % kCellEdge && a.y == b.y % kCellEdge && a.z == b.z % kCellEdge;
    });
    if (same) return uint8_t(state);
  }
  throw InternalError("internal error: the curve through a cell has none of the known states");
}

const CellOrder& cellOrder(int state, int brickOrder) {
  static std::array<std::array<CellOrder, kLargestBrickOrder + 1>, kHilbertStateCount> orders;
  static std::array<std::array<std::once_flag, kLargestBrickOrder + 1>, kHilbertStateCount> made;
  CellOrder& order = orders[size_t(state)][size_t(brickOrder)];
  std::call_once(made[size_t(state)][size_t(brickOrder)], [&] {
    constexpr size_t kCellVoxels = kCellSlices * kSliceBytes;
    const auto curve = hilbertCurve(state, brickOrder);
    for (size_t step = 0; step < curve.size(); step += kCellVoxels) {
      const LocalPosition p = curve[step];
      order.cells.push_back({uint8_t(p.x / kCellEdge), uint8_t(p.y / kCellEdge), uint8_t(p.z / kCellEdge),
                             cellState(curve.subspan(step, kCellVoxels))});
    }
  });
  return order;
}

/// to(y, x, z) = from(x, y, z).
void exchangeXY(const float* from, int edge, float* to) {
  for (int z = 0; z < edge; ++z) {
    for (int y = 0; y < edge; ++y) {
      for (int x = 0; x < edge; ++x)
        to[(z * edge + x) * edge + y] = from[(z * edge + y) * edge + x];
    }
  }
}

}  // namespace

BrickRegeneration::BrickRegeneration(Classification classification, const TransferFunction& transfer,
                                     const ValueCoding& coding)
    : classification_(classification), depths_(coding.largest + 1) {
  const auto segments = makeSegmentDepth(classification, transfer, coding);
  std::vector<uint16_t> codes(coding.largest + 1);
  std::iota(codes.begin(), codes.end(), uint16_t(0));
  std::vector<FixedDepth> own(codes.size()), toNext(codes.size());
  segments->row(codes, codes, own.data());
  const std::span<const uint16_t> all(codes);
  segments->row(all.first(coding.largest), all.subspan(1), toNext.data());
  uint64_t integral = 0;  // in the units of FixedDepth
  for (size_t code = 0; code < codes.size(); ++code) {
    constexpr uint64_t kLowUnits = uint64_t(1) << 20;
    const double depth = double(own[code]) / kDepthUnitsPerLog2;
    depths_[code] = {float(code), float(classification == Classification::voxel ? std::exp2(-depth) : depth),
                     float(double(integral / kLowUnits * kLowUnits) / kDepthUnitsPerLog2),
                     float(double(integral % kLowUnits) / kDepthUnitsPerLog2)};
    integral += toNext[code];
  }
}

void BrickRegeneration::regenerate(const Brick& brick, DirectionSet directions,
                                   const std::array<uint8_t*, shared::kDirectionCount>& planes) const {
  thread_local RegenerationScratch scratch;
  const int edge = brick.edge, brickOrder = std::countr_zero(unsigned(edge));
  const size_t voxels = size_t(edge) * size_t(edge) * size_t(edge);
  for (auto* floats : {&scratch.segments, &scratch.exchangedSegments, &scratch.attenuations})
    floats->resize(voxels + 2 * kSlack);
  scratch.depths.resize(voxels);
  scratch.slices.resize(voxels);
  float* const attenuations = scratch.attenuations.data() + kSlack;
  const CellOrder& order = cellOrder(brick.hilbertState, brickOrder);
  HWY_DYNAMIC_DISPATCH(spreadBrick)
  (brick, hilbertSteps(brick.hilbertState, brickOrder).data(), voxels, depths_.data(), scratch.depths);

  // Opposite directions share their segments.
  for (int forward = kDirectionsPerSection; forward < shared::kDirectionCount; ++forward) {
    const int backward = shared::oppositeDirection(forward);
    if (((directions >> backward | directions >> forward) & 1) == 0) continue;
    const bool preintegrated = classification_ == Classification::preintegrated;
    const glm::ivec3 step(shared::directionX(forward), shared::directionY(forward), shared::directionZ(forward));
    const float* segments = scratch.depths.own.data() + kSlack;  // of a voxel
    if (preintegrated) {
      HWY_DYNAMIC_DISPATCH(segmentRun)
      (scratch.depths, voxels, step.x + edge * (step.y + edge * step.z), scratch.segments.data() + kSlack);
      segments = scratch.segments.data() + kSlack;  // of a voxel and the next one forwards
    }
    const bool exchanged = step.y == 0 && step.z == 0;
    if (exchanged) {
      exchangeXY(segments, edge, scratch.exchangedSegments.data() + kSlack);
      segments = scratch.exchangedSegments.data() + kSlack;
    }
    for (const int direction : {backward, forward}) {
      if ((directions >> direction & 1) == 0) continue;
      const int sign = direction == forward ? 1 : -1;
      const glm::ivec3 way = sign * (exchanged ? glm::ivec3(0, 1, 0) : step);
      const int offset = way.x + edge * (way.y + edge * way.z);
      // Of a pair the segment stands at the backward voxel; of a voxel it belongs to the pair in which it is the outer.
      const int start = preintegrated ? std::min(offset, 0) : offset;
      const SweptDirection swept{edge,
                                 exchanged ? glm::ivec3(brick.extent.y, brick.extent.x, brick.extent.z) : brick.extent,
                                 way,
                                 DirectionFaces(shared::directionIndex(way.x, way.y, way.z), edge),
                                 brick.faces[size_t(direction)],
                                 segments + start};
      HWY_DYNAMIC_DISPATCH(sweepBrick)(swept, attenuations);
      HWY_DYNAMIC_DISPATCH(storePlane)
      (attenuations, scratch.slices.data(), edge, order, cellShuffles(exchanged).data(), exchanged,
       planes[size_t(direction)]);
    }
  }
}

}  // namespace freevoxel
#endif
