#include "precompute/sweep.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/first_exception.h"
#include "base/grid.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep_kernels.h"
#include "shaders/shared/directions.h"

namespace freevoxel {

namespace {

/// Rows of one length, each with kRowUnit entries of 0 before and behind it, on cache lines of their own.
class Rows {
 public:
  Rows() = default;
  Rows(int count, int width) : stride_(size_t(width) + 2 * kRowUnit), lines_(size_t(count) * stride_ / kRowUnit) {}
  FixedDepth* row(int i) { return reinterpret_cast<FixedDepth*>(lines_.data()) + size_t(i) * stride_ + kRowUnit; }
  size_t stride() const { return stride_; }

 private:
  struct alignas(64) Line {
    FixedDepth depths[kRowUnit];
  };
  size_t stride_ = 0;
  std::vector<Line> lines_;
};

/// Sizes that everything here shares. A strip is four rows of voxels, all of x, in every plane of a slab.
struct Shape {
  glm::ivec3 dims;
  int edge;
  int width;  ///< of rows: dims.x rounded up to whole bricks and kRowUnit
  Shape(glm::ivec3 volumeDims, int brickEdge)
      : dims(volumeDims),
        edge(brickEdge),
        width((volumeDims.x + std::max(brickEdge, kRowUnit) - 1) / std::max(brickEdge, kRowUnit) *
              std::max(brickEdge, kRowUnit)) {}
  int runsPerEdge() const { return edge / kRunEdge; }
  int brickRows() const { return (dims.y + edge - 1) / edge; }
  int strips() const { return brickRows() * runsPerEdge(); }
  int slabs() const { return (dims.z + edge - 1) / edge; }
  int slabPlanes(int slab) const { return std::min(edge, dims.z - slab * edge); }
  /// Rows inside the volume.
  int stripRows(int strip) const { return std::clamp(dims.y - strip * kRunEdge, 0, kRunEdge); }
};

/// Codes of a slab and of the plane upstream of it.
struct CodeSlab {
  const uint16_t* codes = nullptr;  ///< of plane `first`
  int first = 0;
};

/// The bricks of a slab that are wanted, row by row.
struct SlabBricks {
  std::vector<std::vector<BrickRow>> rows;
  std::vector<std::vector<uint8_t>> wanted;  ///< of each row, for each kRowUnit voxels: whether a brick lies there
};

SlabBricks sortBricks(const Shape& shape, std::span<const BrickPlanes> bricks) {
  SlabBricks slab;
  slab.rows.resize(size_t(shape.brickRows()));
  slab.wanted.assign(size_t(shape.brickRows()), std::vector<uint8_t>(size_t(shape.width / kRowUnit)));
  const int brickOrder = std::countr_zero(unsigned(shape.edge));
  for (const BrickPlanes& brick : bricks) {
    const int x = brick.position.x * shape.edge;
    const auto row = size_t(brick.position.y);
    slab.rows[row].push_back({x, brickRuns(brick.hilbertState, brickOrder).data(), brick.planes});
    for (int voxel = x; voxel < x + shape.edge; voxel += kRunEdge)
      slab.wanted[row][size_t(voxel / kRowUnit)] = 1;
  }
  for (auto& row : slab.rows)
    std::sort(row.begin(), row.end(), [](const BrickRow& a, const BrickRow& b) { return a.x < b.x; });
  return slab;
}

/// What voxels contribute to segments: of a strip, the rows beside it and the plane before, in the order of the sweep.
class StripTerms {
 public:
  StripTerms(const Shape& shape, SegmentRule rule) : zeros_(1, shape.width) {
    const int rows = (shape.edge + 1) * kRows;
    own_ = Rows(rows, shape.width);
    if (rule == SegmentRule::neighbour) return;
    code_ = Rows(rows, shape.width);
    high_ = Rows(rows, shape.width);
    if (rule == SegmentRule::splitIntegral) low_ = Rows(rows, shape.width);
  }

  /// Fills a plane. `place` counts planes from the one before the slab, which is 0.
  void fill(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int place, int z, int strip) {
    for (int y = -1; y <= kRunEdge; ++y) {
      const glm::ivec3 first(0, strip * kRunEdge + y, z);
      if (first.y < 0 || first.y >= shape.dims.y || z < 0 || z >= shape.dims.z) continue;
      const uint16_t* row = codes.codes + linearIndex(first - glm::ivec3(0, 0, codes.first), shape.dims);
      const int at = index(place, y);
      segments.terms({row, size_t(shape.dims.x)}, {own_.row(at), floats(code_, at), floats(high_, at), floats(low_, at)});
    }
  }

  /// Row y of the strip, -1..kRunEdge.
  SegmentTerms row(int place, int y) {
    const int at = index(place, y);
    return {own_.row(at), floats(code_, at), floats(high_, at), floats(low_, at)};
  }
  /// A row outside the volume.
  SegmentTerms nothing() {
    const auto* zeros = reinterpret_cast<const float*>(zeros_.row(0));
    return {zeros_.row(0), zeros, zeros, zeros};
  }
  const FixedDepth* noDepths() { return zeros_.row(0); }

 private:
  static constexpr int kRows = kRunEdge + 2;
  static int index(int place, int y) { return place * kRows + 1 + y; }
  static float* floats(Rows& rows, int row) {
    return rows.stride() == 0 ? nullptr : reinterpret_cast<float*>(rows.row(row));
  }

  Rows own_, code_, high_, low_, zeros_;
};

/// What a thread needs for the strip at hand.
struct Scratch {
  Scratch(const Shape& shape, SegmentRule rule)
      : terms(shape, rule), segments(1, shape.width), bytes(kRunEdge, shape.width) {}
  StripTerms terms;
  Rows segments;
  Rows bytes;  ///< four planes of a strip: see TilePlane::bytes
};

/// Where a strip of a slab is, and how far its sweep has come.
struct TilePlace {
  int slab, strip;
  int runZ;       ///< of the four planes at hand
  int done;       ///< planes of the slab that are behind, all inside the volume
  int planes;     ///< of the four that are inside the volume
  int firstZ;     ///< of these, the first in the order of the sweep
};

/// Depths along one direction, kept from plane to plane and from strip to strip.
class DirectionSweep {
 public:
  DirectionSweep(int direction, const Shape& shape)
      : direction_(direction),
        step_(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction)),
        state_(step_.z != 0 ? shape.strips() * kRunEdge : kRunEdge, shape.width) {
    if (step_.y == 0) return;
    for (Rows& rows : edges_)
      rows = Rows(shape.edge + 1, shape.width);
  }

  glm::ivec3 step() const { return step_; }

  /// Before the first tile of a strip. Strips come from the outside inwards: ascending where the direction points down
  /// in y, descending where it points up.
  void beginStrip(const Shape& shape, int strip) {
    if (step_.y == 0 || step_.z == 0) return;
    std::memcpy(edges_[1].row(0), stripState(strip) + size_t(leavingRow()) * state_.stride(),
                size_t(shape.width) * sizeof(FixedDepth));
  }

  /// After its last tile.
  void endStrip() { std::swap(edges_[0], edges_[1]); }

  /// Four planes of a strip: their bytes go to the bricks.
  void sweep(const Shape& shape, SegmentRule rule, const TilePlace& place, const SlabBricks& bricks, Scratch& scratch) {
    const auto brickRow = size_t(place.strip / shape.runsPerEdge());
    auto* const bytes = reinterpret_cast<uint8_t*>(scratch.bytes.row(0));
    const size_t planeBytes = scratch.bytes.stride() * sizeof(FixedDepth);
    const int rows = shape.stripRows(place.strip);
    if (place.planes < kRunEdge || rows == 0) {
      std::memset(bytes, kAttenuationOutside, (kRunEdge - 1) * planeBytes + size_t(shape.width) * kRunEdge);
    }
    if (place.planes > 0 && rows > 0) {
      Tile tile;
      tile.rule = rule;
      tile.state = stripState(place.strip);
      tile.stride = state_.stride();
      tile.width = shape.width;
      tile.voxels = shape.dims.x;
      tile.stepX = step_.x;
      tile.stepY = step_.y;
      tile.samePlane = step_.z == 0;
      tile.leavingRow = leavingRow();
      tile.wanted = bricks.wanted[brickRow].data();
      tile.segments = scratch.segments.row(0);
      tile.planeCount = place.planes;
      for (int i = 0; i < place.planes; ++i)
        tile.planes[size_t(i)] = plane(shape, place, i, scratch, bytes, planeBytes);
      sweepTile(tile);
    }
    const auto runs = size_t(shape.runsPerEdge());
    const size_t brickVoxels = size_t(shape.edge) * size_t(shape.edge) * size_t(shape.edge);
    storeRuns(bytes, planeBytes, bricks.rows[brickRow],
              (size_t(place.runZ) * runs + size_t(place.strip) % runs) * runs, int(runs),
              size_t(direction_ % kDirectionsPerSection) * brickVoxels);
  }

 private:
  FixedDepth* stripState(int strip) { return state_.row(step_.z != 0 ? strip * kRunEdge : 0); }
  int leavingRow() const { return step_.y > 0 ? 0 : kRunEdge - 1; }

  TilePlane plane(const Shape& shape, const TilePlace& place, int i, Scratch& scratch, uint8_t* bytes,
                  size_t planeBytes) {
    const int z = place.firstZ - i * zOrder(), done = place.done + i;
    const int neighbourPlace = step_.z != 0 ? done : done + 1;
    const bool planeOutside = z + step_.z < 0 || z + step_.z >= shape.dims.z;
    FixedDepth* const state = stripState(place.strip);
    TilePlane plane;
    for (int y = 0; y < kRunEdge; ++y) {
      const auto row = size_t(y);
      const int volumeY = place.strip * kRunEdge + y, nextY = volumeY + step_.y;
      if (planeOutside || volumeY >= shape.dims.y || nextY < 0 || nextY >= shape.dims.y) {
        plane.next[row] = scratch.terms.noDepths();
        plane.own[row] = plane.neighbour[row] = scratch.terms.nothing();
        continue;
      }
      const bool beyond = y + step_.y < 0 || y + step_.y >= kRunEdge;
      plane.next[row] = beyond ? edges_[0].row(neighbourPlace) : state + ptrdiff_t(y + step_.y) * ptrdiff_t(state_.stride());
      plane.own[row] = scratch.terms.row(done + 1, y);
      plane.neighbour[row] = scratch.terms.row(neighbourPlace, y + step_.y);
    }
    if (step_.y != 0) plane.leaving = edges_[1].row(done + 1);
    plane.bytes = bytes + size_t(z % shape.edge % kRunEdge) * planeBytes;
    return plane;
  }
  int zOrder() const { return sweepPass(direction_) == 0 ? -1 : 1; }

  int direction_;
  glm::ivec3 step_;
  /// Of the plane before, or of a strip of this one if the direction stays in its plane.
  Rows state_;
  /// The rows through which rays come in from the strip before, and those through which they leave this one: before the
  /// first plane of the slab, and after each.
  Rows edges_[2];
};

/// Directions that one thread sweeps together: all strips of a slab, in one order.
struct SweepGroup {
  int pass;
  bool ascending;
  std::vector<DirectionSweep> sweeps;

  void sweepSlab(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int slab,
                 const SlabBricks& bricks, Scratch& scratch) {
    const int planes = shape.slabPlanes(slab), first = slab * shape.edge;
    const int beforeZ = pass == 0 ? first - 1 : first + planes;
    for (int i = 0; i < shape.strips(); ++i) {
      const int strip = ascending ? i : shape.strips() - 1 - i;
      scratch.terms.fill(shape, segments, codes, 0, beforeZ, strip);
      for (DirectionSweep& sweep : sweeps)
        sweep.beginStrip(shape, strip);
      TilePlace place{slab, strip, 0, 0, 0, 0};
      for (int run = 0; run < shape.runsPerEdge(); ++run) {
        place.runZ = pass == 0 ? run : shape.runsPerEdge() - 1 - run;
        place.planes = std::clamp(planes - place.runZ * kRunEdge, 0, kRunEdge);
        place.firstZ = first + place.runZ * kRunEdge + (pass == 0 ? 0 : place.planes - 1);
        for (int p = 0; p < place.planes; ++p)
          scratch.terms.fill(shape, segments, codes, place.done + p + 1, place.firstZ + (pass == 0 ? p : -p), strip);
        for (DirectionSweep& sweep : sweeps)
          sweep.sweep(shape, segments.rule(), place, bricks, scratch);
        place.done += place.planes;
      }
      for (DirectionSweep& sweep : sweeps)
        sweep.endStrip();
    }
    finishStores();
  }
};

/// As few groups as keep the threads busy: each computes anew what depends on voxels only.
std::vector<SweepGroup> makeGroups(const Shape& shape, unsigned passes, int threads) {
  const int passCount = std::popcount(passes);
  const bool merge = threads <= passCount;
  const bool split = threads > 3 * passCount;
  std::vector<SweepGroup> groups;
  for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
    const int pass = sweepPass(direction);
    if ((passes >> pass & 1u) == 0) continue;
    const int y = shared::directionY(direction);
    // Directions within a row go with either order of strips: they join the larger group.
    const int order = y != 0 ? y : merge ? (pass == 0 ? -1 : 1) : 0;
    const auto fits = [&](const SweepGroup& group) {
      const int other = group.sweeps.front().step().y;
      return !split && group.pass == pass && (merge ? group.ascending == (order <= 0) : other == order);
    };
    auto group = std::find_if(groups.begin(), groups.end(), fits);
    if (group == groups.end()) group = groups.insert(groups.end(), {pass, order <= 0, {}});
    group->sweeps.emplace_back(direction, shape);
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const SweepGroup& a, const SweepGroup& b) { return a.sweeps.size() > b.sweeps.size(); });
  return groups;
}

}  // namespace

StoredCodePlanes::StoredCodePlanes(std::span<const uint16_t> codes, glm::ivec3 dims)
    : codes_(codes), planeVoxels_(size_t(dims.x) * size_t(dims.y)) {
  checkEqual(uint64_t(codes.size()), voxelCount(dims), "number of codes");
}

std::span<const uint16_t> StoredCodePlanes::planes(int /*pass*/, int first, int count) {
  return codes_.subspan(size_t(first) * planeVoxels_, size_t(count) * planeVoxels_);
}

void sweepAttenuation(CodePlanes& codes, glm::ivec3 dims, int edge, const SegmentDepth& segments, AttenuationSink& sink,
                      unsigned passes) {
  check(validDims(dims) && validBrickEdge(edge), "dims and brick edge are valid");
  const Shape shape(dims, edge);
  const int threads = omp_get_max_threads();
  std::vector<SweepGroup> groups = makeGroups(shape, passes, threads);
  std::vector<Scratch> scratches;
  for (int i = 0; i < threads; ++i)
    scratches.emplace_back(shape, segments.rule());

  // Both passes run at once, one from each end.
  for (int step = 0; step < shape.slabs(); ++step) {
    const int slabs[kSweepPasses] = {step, shape.slabs() - 1 - step};
    CodeSlab slabCodes[kSweepPasses];
    SlabBricks bricks[kSweepPasses];
    for (int pass = 0; pass < kSweepPasses; ++pass) {
      if ((passes >> pass & 1u) == 0) continue;
      const int slab = slabs[pass];
      const int first = slab * edge, last = first + shape.slabPlanes(slab);
      const int from = pass == 0 ? std::max(first - 1, 0) : first;
      const int to = pass == 0 ? last : std::min(last + 1, dims.z);
      slabCodes[pass] = {codes.planes(pass, from, to - from).data(), from};
      bricks[pass] = sortBricks(shape, sink.begin(pass, slab));
    }
    FirstException failure;
#pragma omp parallel for schedule(dynamic)
    for (size_t i = 0; i < groups.size(); ++i) {
      failure.guard([&] {
        SweepGroup& group = groups[i];
        group.sweepSlab(shape, segments, slabCodes[group.pass], slabs[group.pass], bricks[group.pass],
                        scratches[size_t(omp_get_thread_num())]);
      });
    }
    failure.rethrow();
    for (int pass = 0; pass < kSweepPasses; ++pass) {
      if ((passes >> pass & 1u) != 0) sink.complete(pass, slabs[pass]);
    }
  }
  for (int pass = 0; pass < kSweepPasses; ++pass) {
    if ((passes >> pass & 1u) != 0) codes.release(pass);
  }
}

uint64_t sweepBytes(glm::ivec3 dims, int edge, int passCount, int threads) {
  const Shape shape(dims, edge);
  const uint64_t rowBytes = (uint64_t(shape.width) + 2 * kRowUnit) * sizeof(FixedDepth);
  const auto e = uint64_t(edge);
  const uint64_t directionRows = 9 * uint64_t(shape.strips()) * kRunEdge + 4 * kRunEdge + 9 * 2 * (e + 1);
  const uint64_t threadRows = 4 * (e + 1) * (kRunEdge + 2) + kRunEdge + 2;
  return rowBytes * (uint64_t(passCount) * directionRows + uint64_t(threads) * threadRows);
}

}  // namespace freevoxel
