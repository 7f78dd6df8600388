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

/// A brick while it is swept, voxels x fastest, or with x and y exchanged: so that no direction depends on the voxel
/// before in the same row.
struct SweptBrick {
  int edge = 0;
  glm::ivec3 extent{0};
  std::vector<float> code, own, integralHigh, integralLow;

  float* at(std::vector<float>& floats) const { return floats.data() + kSlack; }
  const float* at(const std::vector<float>& floats) const { return floats.data() + kSlack; }
};

/// A direction in a swept brick.
struct SweptDirection {
  glm::ivec3 step{0};
  DirectionFaces shapes;
  const uint8_t* faces = nullptr;
};

/// What a thread needs, kept from brick to brick.
struct RegenerationScratch {
  SweptBrick brick, exchanged;
  std::vector<float> segments;      ///< transmittance from a voxel to the next one along a direction
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

/// segments[v] = transmittance between v and v + offset, offset > 0, for all v where that lies in the arrays.
void segmentRun(const SweptBrick& brick, int offset, float* HWY_RESTRICT segments) {
  const hn::ScalableTag<float> floats;
  const size_t end = size_t(brick.edge) * size_t(brick.edge) * size_t(brick.edge) - size_t(offset);
  const float* HWY_RESTRICT code = brick.at(brick.code);
  const float* HWY_RESTRICT own = brick.at(brick.own);
  const float* HWY_RESTRICT high = brick.at(brick.integralHigh);
  const float* HWY_RESTRICT low = brick.at(brick.integralLow);
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

/// attenuations[v] = attenuations[v + step] * segment, from the faces inwards. `segments`: of the segment that starts at
/// v, at v + segmentOffset.
template <class D>
void sweepBrickRows(D floats, const SweptBrick& brick, const SweptDirection& direction,
                    const float* HWY_RESTRICT segments, int segmentOffset, float* attenuations) {
  const int edge = brick.edge;
  const glm::ivec3 step = direction.step, extent = brick.extent;
  const int offset = step.x + edge * (step.y + edge * step.z);
  const int outerX = step.x > 0 ? edge - 1 : 0, outerY = step.y > 0 ? edge - 1 : 0, outerZ = step.z > 0 ? edge - 1 : 0;
  const int firstY = step.y < 0 ? 1 : 0, firstZ = step.z < 0 ? 1 : 0;
  const uint8_t* const acrossZ = direction.faces;
  const uint8_t* const acrossY = acrossZ + direction.shapes.acrossZ.bytes();
  const uint8_t* const acrossX = acrossY + direction.shapes.acrossY.bytes();
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
      const float* segment = segments + start + segmentOffset;
      for (size_t x = 0; x < size_t(edge); x += hn::Lanes(floats))
        hn::StoreU(hn::Mul(hn::LoadU(floats, next + x), hn::LoadU(floats, segment + x)), floats, row + x);
      if (step.x != 0) {
        row[outerX] = float(acrossX[(z - firstZ) * direction.shapes.acrossX.width + (y - firstY)]);
      }
    }
    if (extent.x < edge) {
      const int inside = extent.x - (step.x > 0 ? 1 : 0);
      std::fill_n(row + inside, edge - inside, kWholeCode);
    }
  };
  // The outermost loop goes inwards; rows of the inner one do not depend on each other.
  for (int i = 0; i < edge; ++i) {
    const int ascending = (step.z != 0 ? step.z : step.y) < 0 ? i : edge - 1 - i;
    for (int j = 0; j < edge; ++j) {
      if (step.z != 0) {
        sweepRow(j, ascending);
      } else {
        sweepRow(ascending, j);
      }
    }
  }
}

void sweepBrick(const SweptBrick& brick, const SweptDirection& direction, const float* segments, int segmentOffset,
                float* attenuations) {
  if (brick.edge == 8) {
    sweepBrickRows(hn::CappedTag<float, 8>(), brick, direction, segments, segmentOffset, attenuations);
  } else {
    sweepBrickRows(hn::CappedTag<float, 16>(), brick, direction, segments, segmentOffset, attenuations);
  }
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

void spread(const BrickRegeneration::Brick& brick, std::span<const BrickRegeneration::CodeDepth> depths,
            bool exchanged, bool integrals, SweptBrick& swept) {
  const size_t voxels = size_t(brick.edge) * size_t(brick.edge) * size_t(brick.edge);
  const auto edge = size_t(brick.edge);
  swept.edge = brick.edge;
  swept.extent = exchanged ? glm::ivec3(brick.extent.y, brick.extent.x, brick.extent.z) : brick.extent;
  for (auto* floats : {&swept.code, &swept.own, &swept.integralHigh, &swept.integralLow})
    floats->resize(voxels + 2 * kSlack);
  float* const code = swept.at(swept.code);
  float* const own = swept.at(swept.own);
  float* const high = swept.at(swept.integralHigh);
  float* const low = swept.at(swept.integralLow);
  const auto curve = hilbertCurve(brick.hilbertState, std::countr_zero(unsigned(brick.edge)));
  const auto* bytes = reinterpret_cast<const uint8_t*>(brick.codes.data());
  for (size_t step = 0; step < voxels; ++step) {
    const LocalPosition p = curve[step];
    const size_t to = exchanged ? p.y + edge * (p.x + edge * p.z) : p.x + edge * (p.y + edge * p.z);
    const size_t entry = brick.bytesPerCode == 1 ? bytes[step] : bytes[2 * step] | size_t(bytes[2 * step + 1]) << 8;
    const BrickRegeneration::CodeDepth& depth = depths[entry];
    own[to] = depth.own;
    if (!integrals) continue;
    code[to] = depth.code;
    high[to] = depth.integralHigh;
    low[to] = depth.integralLow;
  }
}

SweptDirection sweptDirection(const BrickRegeneration::Brick& brick, int direction) {
  return {{shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction)},
          DirectionFaces(direction, brick.edge),
          brick.faces[size_t(direction)]};
}

/// Along x: the faces across x are those across y of the exchanged brick.
SweptDirection exchangedDirection(const BrickRegeneration::Brick& brick, int direction) {
  const int along = shared::directionIndex(0, shared::directionX(direction), 0);
  return {{0, shared::directionX(direction), 0}, DirectionFaces(along, brick.edge), brick.faces[size_t(direction)]};
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
  const size_t voxels = size_t(brick.edge) * size_t(brick.edge) * size_t(brick.edge);
  scratch.segments.resize(voxels + 2 * kSlack);
  scratch.attenuations.resize(voxels + 2 * kSlack);
  scratch.slices.resize(voxels);
  const CellOrder& order = cellOrder(brick.hilbertState, std::countr_zero(unsigned(brick.edge)));
  const bool integrals = classification_ == Classification::preintegrated;
  bool plain = false, swapped = false;

  // Opposite directions share their segments.
  for (int forward = kDirectionsPerSection; forward < shared::kDirectionCount; ++forward) {
    const int backward = shared::oppositeDirection(forward);
    const bool wanted[2] = {(directions >> backward & 1) != 0, (directions >> forward & 1) != 0};
    if (!wanted[0] && !wanted[1]) continue;
    const bool alongX = forward == shared::directionIndex(1, 0, 0);
    SweptBrick& swept = alongX ? scratch.exchanged : scratch.brick;
    if (bool& spreadOut = alongX ? swapped : plain; !spreadOut) {
      spread(brick, depths_, alongX, integrals, swept);
      spreadOut = true;
    }
    const SweptDirection one = alongX ? exchangedDirection(brick, forward) : sweptDirection(brick, forward);
    const int offset = one.step.x + brick.edge * (one.step.y + brick.edge * one.step.z);
    float* const ofPairs = scratch.segments.data() + kSlack;
    if (integrals) HWY_DYNAMIC_DISPATCH(segmentRun)(swept, offset, ofPairs);
    for (const int direction : {backward, forward}) {
      const bool outwards = direction == forward;
      if (!wanted[outwards ? 1 : 0]) continue;
      const SweptDirection way = alongX ? exchangedDirection(brick, direction) : sweptDirection(brick, direction);
      // The segment of a pair stands at its first voxel, and the transmittance of a voxel at that voxel, the outer one.
      const float* segments = integrals ? ofPairs : swept.at(swept.own);
      const int segmentOffset = integrals ? (outwards ? 0 : -offset) : (outwards ? offset : -offset);
      float* const attenuations = scratch.attenuations.data() + kSlack;
      HWY_DYNAMIC_DISPATCH(sweepBrick)(swept, way, segments, segmentOffset, attenuations);
      HWY_DYNAMIC_DISPATCH(storePlane)
      (attenuations, scratch.slices.data(), brick.edge, order, cellShuffles(alongX).data(), alongX,
       planes[size_t(direction)]);
    }
  }
}

}  // namespace freevoxel
#endif
