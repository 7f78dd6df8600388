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

/// Sizes that everything here shares.
struct Shape {
  glm::ivec3 dims;
  int edge;
  int width;  ///< of rows: dims.x rounded up to whole bricks and kRowUnit
  Shape(glm::ivec3 volumeDims, int brickEdge)
      : dims(volumeDims),
        edge(brickEdge),
        width((volumeDims.x + std::max(brickEdge, kRowUnit) - 1) / std::max(brickEdge, kRowUnit) *
              std::max(brickEdge, kRowUnit)) {}
  int strips() const { return (dims.y + edge - 1) / edge; }
  int slabs() const { return (dims.z + edge - 1) / edge; }
  int slabPlanes(int slab) const { return std::min(edge, dims.z - slab * edge); }
  int stripRows(int strip) const { return std::min(edge, dims.y - strip * edge); }
};

/// Codes of a slab and of the plane upstream of it.
struct CodeSlab {
  const uint16_t* codes = nullptr;  ///< of plane `first`
  int first = 0;
};

/// The strips of a slab, each with the bricks that are wanted.
struct SlabBricks {
  struct Brick {
    int x;  ///< first voxel
    const BrickRun* runs;
    uint8_t* planes;
  };
  std::vector<std::vector<Brick>> strips;
  std::vector<std::vector<StripPart>> parts;  ///< merged
};

SlabBricks sortBricks(const Shape& shape, std::span<const BrickPlanes> bricks) {
  SlabBricks slab;
  slab.strips.resize(size_t(shape.strips()));
  slab.parts.resize(size_t(shape.strips()));
  const int brickOrder = std::countr_zero(unsigned(shape.edge));
  for (const BrickPlanes& brick : bricks) {
    slab.strips[size_t(brick.position.y)].push_back(
        {brick.position.x * shape.edge, brickRuns(brick.hilbertState, brickOrder).data(), brick.planes});
  }
  for (size_t strip = 0; strip < slab.strips.size(); ++strip) {
    std::sort(slab.strips[strip].begin(), slab.strips[strip].end(),
              [](const SlabBricks::Brick& a, const SlabBricks::Brick& b) { return a.x < b.x; });
    auto& parts = slab.parts[strip];
    for (const SlabBricks::Brick& brick : slab.strips[strip]) {
      const int first = brick.x / kRowUnit * kRowUnit;
      const int last = (brick.x + shape.edge + kRowUnit - 1) / kRowUnit * kRowUnit;
      if (!parts.empty() && parts.back().last >= first) {
        parts.back().last = last;
      } else {
        parts.push_back({first, last});
      }
    }
  }
  return slab;
}

/// What a thread needs for the strip at hand.
struct Scratch {
  explicit Scratch(const Shape& shape, bool shared)
      : segments(shared ? (shape.edge + 1) * (shape.edge + 2) : shape.edge, shape.width),
        words(size_t(kRunEdge) * size_t(shape.edge / kRunEdge) * size_t(shape.width)) {}
  /// If segments depend on the neighbour only: those to every voxel of the strip and of the rows and the plane around
  /// it, in the order of the sweep. Else those of one plane.
  Rows segments;
  std::vector<uint32_t> words;  ///< four planes of a strip, as codeStrip makes them
};

/// Depths along one direction, kept from plane to plane and from strip to strip.
class DirectionSweep {
 public:
  DirectionSweep(int direction, const Shape& shape)
      : direction_(direction),
        step_(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction)),
        state_(step_.z != 0 ? shape.strips() * shape.edge : shape.edge, shape.width) {
    if (step_.y == 0) return;
    for (Rows& rows : edges_)
      rows = Rows(shape.edge + 1, shape.width);
  }

  int direction() const { return direction_; }
  glm::ivec3 step() const { return step_; }

  /// All planes of a strip. Strips come from the outside inwards: ascending where the direction points down in y,
  /// descending where it points up.
  void sweepStrip(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int slab, int strip,
                  const SlabBricks& bricks, Scratch& scratch) {
    const int rows = shape.stripRows(strip);
    const int planes = shape.slabPlanes(slab);
    FixedDepth* state = state_.row(step_.z != 0 ? strip * shape.edge : 0);
    if (step_.z == 0) {
      for (int y = rows; y < shape.edge; ++y)
        std::fill_n(state + size_t(y) * state_.stride(), shape.width, 0);
    }
    const bool up = sweepPass(direction_) == 0;
    int done = 0;  // planes inside the volume
    const auto rowBytes = size_t(shape.width) * sizeof(FixedDepth);
    const FixedDepth* leaving = state + size_t(step_.y > 0 ? 0 : rows - 1) * state_.stride();
    if (step_.y != 0) std::memcpy(edges_[1].row(0), leaving, rowBytes);
    const size_t planeWords = scratch.words.size() / kRunEdge;
    const auto& parts = bricks.parts[size_t(strip)];
    for (int i = 0; i < shape.edge; ++i) {
      const int local = up ? i : shape.edge - 1 - i;
      uint32_t* words = scratch.words.data() + size_t(local % kRunEdge) * planeWords;
      if (local >= planes) {
        std::fill_n(words, planeWords, ~0u);
      } else {
        sweepPlane(shape, segments, codes, slab, strip, local, done, state, scratch);
        ++done;
        if (step_.y != 0) std::memcpy(edges_[1].row(done), leaving, rowBytes);
        codeStrip(state, state_.stride(), shape.edge, shape.width, parts, words);
      }
      if (i % kRunEdge == kRunEdge - 1) storePlanes(shape, bricks.strips[size_t(strip)], local / kRunEdge, scratch);
    }
    std::swap(edges_[0], edges_[1]);
  }

 private:
  /// `done`: planes of the slab that are behind, all inside the volume.
  void sweepPlane(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int slab, int strip,
                  int local, int done, FixedDepth* state, Scratch& scratch) {
    const int z = slab * shape.edge + local;
    const int firstRow = strip * shape.edge;
    StripUpdate update;
    update.state = state;
    update.stride = state_.stride();
    update.rows = shape.stripRows(strip);
    update.width = shape.width;
    update.voxels = shape.dims.x;
    update.stepX = step_.x;
    update.stepY = step_.y;
    update.samePlane = step_.z == 0;
    if (z + step_.z < 0 || z + step_.z >= shape.dims.z) {
      for (int y = 0; y < update.rows; ++y)
        std::fill_n(state + size_t(y) * update.stride, shape.width, 0);
      return;
    }
    const int beyond = step_.y > 0 ? firstRow + update.rows : firstRow - 1;
    if (step_.y != 0 && beyond >= 0 && beyond < shape.dims.y) {
      update.upstream = edges_[0].row(step_.z != 0 ? done : done + 1);
    }
    update.segmentStride = scratch.segments.stride();
    if (segments.isOfNeighbourOnly()) {
      const int plane = step_.z != 0 ? done : done + 1;
      update.segments = scratch.segments.row(plane * (shape.edge + 2) + 1 + step_.y) + step_.x;
    } else {
      classifySegments(shape, segments, codes, z, firstRow, update.rows, scratch.segments);
      update.segments = scratch.segments.row(0);
    }
    updateStrip(update);
  }

  void classifySegments(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int z, int firstRow,
                        int rows, Rows& out) const {
    const int first = std::max(0, -step_.x);
    const int last = shape.dims.x - std::max(0, step_.x);
    for (int y = 0; y < rows; ++y) {
      const int nextY = firstRow + y + step_.y;
      if (nextY < 0 || nextY >= shape.dims.y) continue;
      FixedDepth* row = out.row(y);
      row[0] = row[shape.dims.x - 1] = 0;
      if (first >= last) continue;
      const auto count = size_t(last - first);
      const uint16_t* own = codes.codes + linearIndex({first, firstRow + y, z - codes.first}, shape.dims);
      const uint16_t* next = codes.codes + linearIndex({first + step_.x, nextY, z + step_.z - codes.first}, shape.dims);
      segments.row({own, count}, {next, count}, row + first);
    }
  }

  void storePlanes(const Shape& shape, const std::vector<SlabBricks::Brick>& bricks, int runZ,
                   const Scratch& scratch) const {
    const int runs = shape.edge / kRunEdge;
    const size_t brickVoxels = size_t(shape.edge) * size_t(shape.edge) * size_t(shape.edge);
    const size_t plane = size_t(direction_ % kDirectionsPerSection) * brickVoxels;
    for (const SlabBricks::Brick& brick : bricks) {
      storeRuns(scratch.words.data() + brick.x, scratch.words.size() / kRunEdge, shape.width,
                brick.runs + size_t(runZ) * size_t(runs) * size_t(runs), runs, brick.planes + plane);
    }
  }

  int direction_;
  glm::ivec3 step_;
  Rows state_;                 ///< of the plane; where the direction lies in the plane, of a strip
  std::array<Rows, 2> edges_;  ///< of the strip upstream and of this one: the row next to the strip downstream, before
                               ///< the slab and after each of its planes
};

/// Directions of one pass whose strips can be swept in the same order, so that they share what depends on voxels only.
struct SweepGroup {
  int pass = 0;
  bool ascending = true;
  std::vector<DirectionSweep> sweeps;

  void sweepSlab(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int slab,
                 const SlabBricks& bricks, Scratch& scratch) {
    for (int i = 0; i < shape.strips(); ++i) {
      const int strip = ascending ? i : shape.strips() - 1 - i;
      if (segments.isOfNeighbourOnly()) classifyStrip(shape, segments, codes, slab, strip, scratch.segments);
      for (DirectionSweep& sweep : sweeps)
        sweep.sweepStrip(shape, segments, codes, slab, strip, bricks, scratch);
    }
    finishStores();
  }

 private:
  void classifyStrip(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int slab, int strip,
                     Rows& out) const {
    const int planes = shape.slabPlanes(slab);
    const int firstRow = strip * shape.edge;
    const auto count = size_t(shape.dims.x);
    for (int i = 0; i <= planes; ++i) {
      const int z = slab * shape.edge + (pass == 0 ? i - 1 : planes - i);
      if (z < 0 || z >= shape.dims.z) continue;
      for (int y = std::max(firstRow - 1, 0); y < std::min(firstRow + shape.edge + 1, shape.dims.y); ++y) {
        const uint16_t* row = codes.codes + linearIndex({0, y, z - codes.first}, shape.dims);
        segments.row({row, count}, {row, count}, out.row(i * (shape.edge + 2) + 1 + y - firstRow));
      }
    }
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
    scratches.emplace_back(shape, segments.isOfNeighbourOnly());

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
  const uint64_t directionRows = 9 * uint64_t(shape.strips()) * e + 4 * e + 11 * 2 * (e + 1);
  const uint64_t threadRows = (e + 1) * (e + 2) + e;
  return rowBytes * (uint64_t(passCount) * directionRows + uint64_t(threads) * threadRows);
}

}  // namespace freevoxel
