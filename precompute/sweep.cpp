#include "precompute/sweep.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
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

/// Rows of one length, each with room for kRowUnit entries before and behind it, on cache lines of their own. All 0 at
/// first.
class Rows {
 public:
  Rows() = default;
  Rows(int count, int width, SweepMemory& memory)
      : stride_(size_t(width) + 2 * kRowUnit), first_(memory.zeros(size_t(count) * stride_)) {}
  FixedDepth* row(int i) { return first_ + size_t(i) * stride_ + kRowUnit; }
  size_t stride() const { return stride_; }

 private:
  size_t stride_ = 0;
  FixedDepth* first_ = nullptr;
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

/// What voxels contribute to segments: of a strip and, unless only a neighbour's own counts, the rows beside it, for a
/// tile and the plane before, in the order of the sweep. Few enough rows to stay in a near cache: a tile reads them
/// once for each direction.
class StripTerms {
 public:
  StripTerms(const Shape& shape, SegmentRule rule, SweepMemory& memory)
      : beside_(rule != SegmentRule::neighbour), own_(kAllRows, shape.width, memory) {
    if (rule == SegmentRule::neighbour) return;
    code_ = Rows(kAllRows, shape.width, memory);
    std::fill_n(floats(code_, 0) - kRowUnit, size_t(kAllRows) * code_.stride(), kOutsideCode);
    high_ = Rows(kAllRows, shape.width, memory);
    if (rule == SegmentRule::splitIntegral) low_ = Rows(kAllRows, shape.width, memory);
  }

  /// Which rows beside the strip will be read.
  void begin(int strip, bool rowBefore, bool rowBehind) {
    strip_ = strip;
    rowsBefore_ = beside_ && rowBefore ? 1 : 0;
    rowsBehind_ = beside_ && rowBehind ? 1 : 0;
  }

  /// Fills a plane of the strip. `place` counts planes from the one before the slab, which is 0. The next strip will be
  /// `nextStrip`.
  void fill(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int place, int z, int nextStrip) {
    if (z < 0 || z >= shape.dims.z || (place == 0 && !beside_)) return;
    const uint16_t* const plane = codes.codes + linearIndex({0, 0, z - codes.first}, shape.dims);
    const auto width = size_t(shape.dims.x);
    const int inside = shape.stripRows(strip_);
    for (int y = inside; y < kRunEdge; ++y)
      clear(rowOf(place, y), width);
    if (inside == 0) return;
    const auto rows = [&](int first, int end, ptrdiff_t ahead) {
      return CodeRows{plane + size_t(strip_ * kRunEdge + first) * width, width, size_t(end - first), ahead};
    };
    // Rows of successive planes lie too far apart for the processor to foresee.
    const bool last = nextStrip < 0 || nextStrip >= shape.strips();
    const ptrdiff_t ahead = last ? 0 : ptrdiff_t(nextStrip - strip_) * kRunEdge * shape.dims.x;
    if (place != 0) segments.terms(rows(0, inside, ahead), {own_.row(rowOf(place, 0))}, own_.stride());
    if (!beside_) return;
    int first = -rowsBefore_, end = inside + (inside == kRunEdge ? rowsBehind_ : 0);
    if (strip_ == 0 && first < 0) clear(rowOf(place, first++), width);
    if (strip_ * kRunEdge + end > shape.dims.y) clear(rowOf(place, --end), width);
    const int row = rowOf(place, first);
    segments.terms(rows(first, end, place != 0 ? 0 : ahead),
                   {nullptr, floats(code_, row), floats(high_, row), floats(low_, row)}, own_.stride());
  }

  SegmentTerms all() { return {own_.row(0), floats(code_, 0), floats(high_, 0), floats(low_, 0)}; }
  /// Entry in all() at which a plane starts, one of the last kPlanes filled.
  ptrdiff_t plane(int place) const { return entry(place % kPlanes * kPlaneRows); }
  /// From there to row y of the strip, -1..kRunEdge.
  ptrdiff_t row(int y) const { return entry(y + 1); }

 private:
  static constexpr int kPlanes = kRunEdge + 1;
  static constexpr int kPlaneRows = kRunEdge + 2;
  /// Makes segments 0 that lead outside the volume: a finite integral is divided by it.
  static constexpr float kOutsideCode = std::numeric_limits<float>::infinity();

 public:
  static constexpr int kAllRows = kPlanes * kPlaneRows;

 private:
  void clear(int row, size_t count) {
    std::fill_n(own_.row(row), count, 0u);
    if (!beside_) return;
    std::fill_n(floats(code_, row), count, kOutsideCode);
    std::fill_n(floats(high_, row), count, 0.0f);
    if (low_.stride() != 0) std::fill_n(floats(low_, row), count, 0.0f);
  }
  ptrdiff_t entry(int row) const { return ptrdiff_t(size_t(row) * own_.stride()); }
  static float* floats(Rows& rows, int row) {
    return rows.stride() == 0 ? nullptr : reinterpret_cast<float*>(rows.row(row));
  }

  static int rowOf(int place, int y) { return place % kPlanes * kPlaneRows + y + 1; }

  bool beside_;  ///< rows beside the strip and the plane before may count
  Rows own_, code_, high_, low_;
  int strip_ = 0, rowsBefore_ = 0, rowsBehind_ = 0;
};

/// What a thread needs for the strip at hand.
struct Scratch {
  Scratch(const Shape& shape, SegmentRule rule, SweepMemory& memory)
      : terms(shape, rule, memory),
        noDepths(1, shape.width, memory),
        depths(kFanDirections * kRunEdge, shape.width, memory),
        bytes(kFanDirections * kRunEdge, shape.width, memory) {}
  StripTerms terms;
  Rows noDepths;  ///< zeros
  // For each step along x:
  Rows depths;  ///< of one plane of a strip
  Rows bytes;   ///< four planes of a strip: see TilePlane::bytes
};

/// Four planes of a strip, in the order of the sweep.
struct TilePlace {
  int strip;
  int runZ;       ///< of the planes, in the slab
  int planes;     ///< inside the volume
  int firstZ;     ///< of these
  int done;       ///< planes of the slab that are behind, all inside the volume
  int nextStrip;  ///< will be swept next, or lies outside the volume
};

/// Depths along one direction, kept from plane to plane and from strip to strip.
class DirectionSweep {
 public:
  DirectionSweep(int direction, const Shape& shape, SegmentRule rule, SweepMemory& memory)
      : direction_(direction),
        step_(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction)),
        state_(step_.z != 0 ? shape.strips() * kRunEdge : 0, shape.width, memory) {
    if (step_.y != 0) edges_ = Rows(edgeRows(shape), shape.width, memory);
    tile_.rule = rule;
    tile_.stride = state_.stride();
    tile_.width = shape.width;
    tile_.stepX = step_.x;
    tile_.stepY = step_.y;
    tile_.samePlane = step_.z == 0;
  }

  glm::ivec3 step() const { return step_; }
  int direction() const { return direction_; }

  /// Depths of the last plane swept, dims.x * dims.y: of directions that leave planes.
  void setDepths(const Shape& shape, const FixedDepth* depths) {
    for (int y = 0; y < shape.dims.y; ++y)
      std::copy_n(depths + size_t(y) * size_t(shape.dims.x), shape.dims.x, state_.row(y));
  }
  void getDepths(const Shape& shape, FixedDepth* depths) {
    for (int y = 0; y < shape.dims.y; ++y)
      std::copy_n(state_.row(y), shape.dims.x, depths + size_t(y) * size_t(shape.dims.x));
  }

  /// Before the first tile of a strip. Strips come from the outside inwards: ascending where the direction points down
  /// in y, descending where it points up.
  void beginStrip(const Shape& shape, int strip, const SlabBricks& bricks, Scratch& scratch) {
    tile_.terms = scratch.terms.all();
    tile_.state = state_.row(step_.z != 0 ? strip * kRunEdge : 0);
    tile_.wanted = bricks.wanted[size_t(strip / shape.runsPerEdge())].data();
    // Room of its own only for what is swept together: the less, the nearer it stays.
    const int room = tile_.rule == SegmentRule::neighbour ? 0 : (step_.x + 1) * kRunEdge;
    tile_.depths = scratch.depths.row(room);
    bytes_ = reinterpret_cast<uint8_t*>(scratch.bytes.row(room));
    planeBytes_ = scratch.bytes.stride() * sizeof(FixedDepth);
    const int rowBeyond = step_.y > 0 ? (strip + 1) * kRunEdge : strip * kRunEdge - 1;
    nothingBeyond_ = rowBeyond < 0 || rowBeyond >= shape.dims.y ? scratch.noDepths.row(0) : nullptr;
    if (step_.y != 0 && step_.z != 0) {
      std::memcpy(leaving(shape, 0), tile_.state + (step_.y > 0 ? 0 : kRunEdge - 1) * tile_.stride,
                  size_t(shape.width) * sizeof(FixedDepth));
    }
  }

  /// After its last tile.
  void endStrip(const Shape& shape) { firstEdge_ = (firstEdge_ + edgeRows(shape) - edgeShift()) % edgeRows(shape); }

  /// Four planes of the strip are next.
  void beginTile(const Shape& shape, const TilePlace& place, const Scratch& scratch) {
    if (step_.z != 0) prefetchState(shape, place);
    if (place.planes < kRunEdge) {
      std::memset(bytes_, kAttenuationOutside, (kRunEdge - 1) * planeBytes_ + size_t(shape.width) * kRunEdge);
    }
    const int order = sweepPass(direction_) == 0 ? 1 : -1;
    for (int i = 0; i < place.planes; ++i) {
      const int z = place.firstZ + order * i, done = place.done + i;
      const int neighbourPlace = step_.z != 0 ? done : done + 1;
      TilePlane& plane = tile_.planes[size_t(i)];
      plane.own = scratch.terms.plane(done + 1) + scratch.terms.row(0);
      plane.neighbour = scratch.terms.plane(neighbourPlace) + scratch.terms.row(step_.y) + step_.x;
      plane.neighbourOutside = z + step_.z < 0 || z + step_.z >= shape.dims.z;
      plane.bytes = bytes_ + size_t(z % kRunEdge) * planeBytes_;
      if (step_.y == 0) continue;
      plane.beyond = nothingBeyond_ != nullptr ? nothingBeyond_ : beyond(shape, neighbourPlace);
      plane.leaving = leaving(shape, done + 1);
    }
    tile_.planeCount = place.planes;
    tile_.depthsWanted = false;
  }

  void sweep(const Shape& shape, const CodeSlab& codes, const TilePlace& place, const LevelTarget& levels) {
    levels.depths != nullptr ? sweepPlanes(shape, codes, place, levels) : sweepTile(tile_);
  }

  /// Whether sweepFan may take `first` and the two directions after it.
  static bool isFan(const DirectionSweep* first, const DirectionSweep* end) {
    if (end - first < kFanDirections || first->tile_.rule == SegmentRule::neighbour) return false;
    for (int i = 0; i < kFanDirections; ++i) {
      if (first[i].step_ != glm::ivec3(i - 1, first->step_.y, first->step_.z)) return false;
    }
    return true;
  }
  static void sweepFan(const DirectionSweep* first) {
    freevoxel::sweepFan({&first[0].tile_, &first[1].tile_, &first[2].tile_});
  }

  /// Its bytes go to the bricks.
  void endTile(const Shape& shape, const TilePlace& place, const SlabBricks& bricks) {
    clearOutside(shape, place.strip, bytes_, planeBytes_);
    const int runs = shape.runsPerEdge();
    const size_t brickVoxels = size_t(shape.edge) * size_t(shape.edge) * size_t(shape.edge);
    storeRuns(bytes_, planeBytes_, bricks.rows[size_t(place.strip / runs)],
              size_t((place.runZ * runs + place.strip % runs) * runs), runs,
              size_t(direction_ % kDirectionsPerSection) * brickVoxels);
  }

 private:
  static int edgeRows(const Shape& shape) { return shape.edge + 2; }
  /// How far the place of what leaves lies before that of what comes in.
  int edgeShift() const { return step_.z != 0 ? 1 : 0; }
  /// For 0 <= place < edgeRows.
  FixedDepth* beyond(const Shape& shape, int place) {
    const int row = firstEdge_ + place;
    return edges_.row(row < edgeRows(shape) ? row : row - edgeRows(shape));
  }
  FixedDepth* leaving(const Shape& shape, int place) {
    const int row = place - edgeShift();
    return beyond(shape, row >= 0 ? row : row + edgeRows(shape));
  }

  /// What the next strip will read first, a row at a time: it has left the nearer caches since the slab before.
  void prefetchState(const Shape& shape, const TilePlace& place) {
    if (place.nextStrip < 0 || place.nextStrip >= shape.strips() || place.runZ >= kRunEdge) return;
    const FixedDepth* const row = state_.row(place.nextStrip * kRunEdge + place.runZ);
    for (int x = 0; x < shape.width; x += kRowUnit)
      __builtin_prefetch(row + x, 1, 2);
  }

  /// Bytes of voxels outside the volume.
  static void clearOutside(const Shape& shape, int strip, uint8_t* bytes, size_t planeBytes) {
    const int rowsInside = shape.stripRows(strip);
    if (rowsInside == kRunEdge && shape.dims.x == shape.width) return;
    for (int plane = 0; plane < kRunEdge; ++plane, bytes += planeBytes) {
      for (int row = 0; row < kRunEdge; ++row) {
        for (int x = row < rowsInside ? shape.dims.x : 0; x < shape.width; ++x)
          bytes[kRunEdge * (x - x % 4) + 4 * row + x % 4] = kAttenuationOutside;
      }
    }
  }

  /// One plane of the tile after the other, since level 1 needs the depths of each.
  void sweepPlanes(const Shape& shape, const CodeSlab& codes, const TilePlace& place, const LevelTarget& levels) {
    const std::array<TilePlane, kRunEdge> planes = tile_.planes;
    const bool up = sweepPass(direction_) == 0;
    const int firstRow = place.strip * kRunEdge, slab = place.firstZ / shape.edge;
    const auto columns = size_t(shape.dims.x + 1) / 2, rows = size_t(shape.dims.y + 1) / 2;
    tile_.planeCount = 1;
    tile_.depthsWanted = true;
    for (int i = 0; i < place.planes; ++i) {
      tile_.planes[0] = planes[size_t(i)];
      sweepTile(tile_);
      const int z = place.firstZ + (up ? i : -i), local = z - slab * shape.edge;
      LevelTap::Plane plane{tile_.depths, tile_.stride, nullptr, std::min(kRunEdge, shape.dims.y - firstRow),
                            shape.dims.x};
      if (levels.weights != nullptr)
        plane.codes = codes.codes + linearIndex({0, firstRow, z - codes.first}, shape.dims);
      // Planes 2 n and 2 n + 1 come one after the other, in either order.
      const bool lower = local % 2 == 0, lone = lower && z + 1 == shape.dims.z;
      LevelDepth* out =
          levels.depths +
          size_t(direction_ % kDirectionsPerSection) * LevelTarget::directionSize(shape.dims, shape.edge) +
          (size_t(local / 2) * rows + size_t(firstRow / 2)) * columns;
      tap_.add(plane, levels.weights, lone || lower == up, lone || lower != up, out);
    }
  }

  int direction_;
  glm::ivec3 step_;
  /// Of the plane before, or of a strip of this one if the direction stays in its plane.
  Rows state_;
  /// A ring of the rows through which rays come in from the strip before: before the first plane of the slab, and after
  /// each. A row through which they leave this strip takes the place of the one that the same plane has read.
  Rows edges_;
  int firstEdge_ = 0;
  const FixedDepth* nothingBeyond_ = nullptr;  ///< zeros, if the strip before lies outside the volume
  Tile tile_;                                  ///< at hand
  uint8_t* bytes_ = nullptr;                   ///< its bytes, plane after plane
  size_t planeBytes_ = 0;
  LevelTap tap_;
};

/// Where a direction's plane starts in BorderDepths.
size_t borderOffset(const Shape& shape, int direction) {
  const int place = direction - borderDirection(sweepPass(direction), 0);
  return size_t(place) * size_t(shape.dims.x) * size_t(shape.dims.y);
}

/// Directions that one thread sweeps together: all strips of a slab, in one order.
struct SweepGroup {
  int pass;
  bool ascending;
  std::vector<int> directions;
  std::vector<DirectionSweep> sweeps;  ///< made with the first slab, by the thread that uses them

  void sweepSlab(const Shape& shape, const SegmentDepth& segments, const CodeSlab& codes, int slab,
                 const SlabBricks& bricks, const LevelTarget& levels, const std::vector<FixedDepth>& incoming,
                 Scratch& scratch, SweepMemory& memory) {
    if (sweeps.empty()) {
      for (const int direction : directions) {
        sweeps.emplace_back(direction, shape, segments.rule(), memory);
        if (sweeps.back().step().z != 0 && !incoming.empty()) {
          sweeps.back().setDepths(shape, incoming.data() + borderOffset(shape, direction));
        }
      }
    }
    const int planes = shape.slabPlanes(slab), first = slab * shape.edge;
    const int order = pass == 0 ? 1 : -1;
    const auto leadsTo = [&](int stepY) {
      return std::any_of(sweeps.begin(), sweeps.end(), [&](const DirectionSweep& s) { return s.step().y == stepY; });
    };
    const bool rowBefore = leadsTo(-1), rowBehind = leadsTo(1);
    for (int i = 0; i < shape.strips(); ++i) {
      const int strip = ascending ? i : shape.strips() - 1 - i;
      scratch.terms.begin(strip, rowBefore, rowBehind);
      const int nextStrip = ascending ? strip + 1 : strip - 1;
      scratch.terms.fill(shape, segments, codes, 0, pass == 0 ? first - 1 : first + planes, nextStrip);
      for (DirectionSweep& sweep : sweeps)
        sweep.beginStrip(shape, strip, bricks, scratch);
      int done = 0;
      for (int run = 0; run < shape.runsPerEdge(); ++run) {
        TilePlace place{strip, pass == 0 ? run : shape.runsPerEdge() - 1 - run, 0, 0, done, nextStrip};
        place.planes = std::clamp(planes - place.runZ * kRunEdge, 0, kRunEdge);
        place.firstZ = first + place.runZ * kRunEdge + (pass == 0 ? 0 : place.planes - 1);
        for (int p = 0; p < place.planes; ++p)
          scratch.terms.fill(shape, segments, codes, done + p + 1, place.firstZ + order * p, nextStrip);
        sweepTiles(shape, codes, place, bricks, levels, scratch);
        done += place.planes;
      }
      for (DirectionSweep& sweep : sweeps)
        sweep.endStrip(shape);
    }
    finishStores();
  }

 private:
  /// Four planes of a strip.
  void sweepTiles(const Shape& shape, const CodeSlab& codes, const TilePlace& place, const SlabBricks& bricks,
                  const LevelTarget& levels, const Scratch& scratch) {
    const bool inside = place.planes > 0 && shape.stripRows(place.strip) > 0;
    DirectionSweep* const end = sweeps.data() + sweeps.size();
    for (DirectionSweep* sweep = sweeps.data(); sweep < end;) {
      const bool fan = levels.depths == nullptr && DirectionSweep::isFan(sweep, end);
      const std::span<DirectionSweep> together(sweep, fan ? kFanDirections : 1);
      for (DirectionSweep& one : together)
        one.beginTile(shape, place, scratch);
      if (inside) fan ? DirectionSweep::sweepFan(sweep) : sweep->sweep(shape, codes, place, levels);
      for (DirectionSweep& one : together)
        one.endTile(shape, place, bricks);
      sweep += together.size();
    }
  }
};

/// As few groups as keep the threads busy: each computes anew what depends on voxels only.
std::vector<SweepGroup> makeGroups(unsigned passes, bool bordersOnly, int threads) {
  const int passCount = std::popcount(passes);
  const bool merge = threads <= passCount;
  const bool split = threads > 3 * passCount;
  std::vector<SweepGroup> groups;
  for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
    const int pass = sweepPass(direction);
    if ((passes >> pass & 1u) == 0 || (bordersOnly && shared::directionZ(direction) == 0)) continue;
    const int y = shared::directionY(direction);
    // Directions within a row go with either order of strips: they join the larger group.
    const int order = y != 0 ? y : merge ? (pass == 0 ? -1 : 1) : 0;
    const auto fits = [&](const SweepGroup& group) {
      const int other = shared::directionY(group.directions.front());
      return !split && group.pass == pass && (merge ? group.ascending == (order <= 0) : other == order);
    };
    auto group = std::find_if(groups.begin(), groups.end(), fits);
    if (group == groups.end()) group = groups.insert(groups.end(), {pass, order <= 0, {}, {}});
    group->directions.push_back(direction);
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const SweepGroup& a, const SweepGroup& b) { return a.directions.size() > b.directions.size(); });
  return groups;
}

/// Numbers that sweeps keep: see sweepBytes.
uint64_t sweepMemory(const Shape& shape, int passCount, int threads) {
  const uint64_t row = uint64_t(shape.width) + 2 * kRowUnit;
  const auto e = uint64_t(shape.edge);
  const uint64_t directionRows = 9 * uint64_t(shape.strips()) * kRunEdge + 9 * (e + 2);
  const uint64_t threadRows = 4 * StripTerms::kAllRows + 2 * kFanDirections * kRunEdge + 1;
  return row * (uint64_t(passCount) * directionRows + uint64_t(threads) * threadRows);
}

/// Gives the groups as they are after the last slab; their depths lie in `memory`.
std::vector<SweepGroup> sweepSlabs(CodePlanes& codes, const Shape& shape, const SegmentDepth& segments,
                                   AttenuationSink& sink, unsigned passes, const SweepPart& part, SweepMemory& memory) {
  check(validDims(shape.dims) && validBrickEdge(shape.edge), "dims and brick edge are valid");
  check(0 <= part.firstSlab && part.firstSlab <= part.lastSlab && part.lastSlab <= shape.slabs(), "slabs are there");
  const int threads = omp_get_max_threads();
  std::vector<SweepGroup> groups = makeGroups(passes, part.bordersOnly, threads);
  std::vector<Scratch> scratches;
  for (int i = 0; i < threads; ++i)
    scratches.emplace_back(shape, segments.rule(), memory);

  // Both passes run at once, one from each end.
  for (int step = 0; step < part.lastSlab - part.firstSlab; ++step) {
    const int slabs[kSweepPasses] = {part.firstSlab + step, part.lastSlab - 1 - step};
    CodeSlab slabCodes[kSweepPasses];
    SlabBricks bricks[kSweepPasses];
    LevelTarget levels[kSweepPasses];
    for (int pass = 0; pass < kSweepPasses; ++pass) {
      if ((passes >> pass & 1u) == 0) continue;
      const int slab = slabs[pass];
      const int first = slab * shape.edge, last = first + shape.slabPlanes(slab);
      const int from = pass == 0 ? std::max(first - 1, 0) : first;
      const int to = pass == 0 ? last : std::min(last + 1, shape.dims.z);
      slabCodes[pass] = {codes.planes(pass, from, to - from).data(), from};
      bricks[pass] = sortBricks(shape, sink.begin(pass, slab));
      levels[pass] = sink.levels(pass, slab);
    }
    FirstException failure;
    // What a group keeps stays near the thread that has always swept it.
#pragma omp parallel for schedule(static, 1)
    for (size_t i = 0; i < groups.size(); ++i) {
      failure.guard([&] {
        SweepGroup& group = groups[i];
        group.sweepSlab(shape, segments, slabCodes[group.pass], slabs[group.pass], bricks[group.pass],
                        levels[group.pass], part.incoming[size_t(group.pass)], scratches[size_t(omp_get_thread_num())],
                        memory);
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
                      unsigned passes, SweepMemory& memory) {
  const Shape shape(dims, edge);
  memory.begin(sweepMemory(shape, std::popcount(passes), omp_get_max_threads()));
  sweepSlabs(codes, shape, segments, sink, passes, {0, shape.slabs(), {}, false}, memory);
}

void sweepAttenuation(CodePlanes& codes, glm::ivec3 dims, int edge, const SegmentDepth& segments, AttenuationSink& sink,
                      unsigned passes) {
  SweepMemory memory;
  sweepAttenuation(codes, dims, edge, segments, sink, passes, memory);
}

BorderDepths sweepPart(CodePlanes& codes, glm::ivec3 dims, int edge, const SegmentDepth& segments,
                       AttenuationSink& sink, unsigned passes, const SweepPart& part) {
  const Shape shape(dims, edge);
  SweepMemory memory;
  memory.begin(sweepMemory(shape, std::popcount(passes), omp_get_max_threads()));
  std::vector<SweepGroup> groups = sweepSlabs(codes, shape, segments, sink, passes, part, memory);
  BorderDepths outgoing;
  for (SweepGroup& group : groups) {
    auto& depths = outgoing[size_t(group.pass)];
    depths.resize(size_t(kBorderDirections) * size_t(dims.x) * size_t(dims.y));
    for (DirectionSweep& sweep : group.sweeps) {
      if (sweep.step().z != 0) sweep.getDepths(shape, depths.data() + borderOffset(shape, sweep.direction()));
    }
  }
  return outgoing;
}

void addIncoming(std::span<const FixedDepth> incoming, int direction, int planes, glm::ivec3 dims,
                 std::span<FixedDepth> own) {
  const int64_t stepX = int64_t(shared::directionX(direction)) * planes;
  const int64_t stepY = int64_t(shared::directionY(direction)) * planes;
  for (int64_t y = std::max<int64_t>(0, -stepY); y < std::min<int64_t>(dims.y, dims.y - stepY); ++y) {
    for (int64_t x = std::max<int64_t>(0, -stepX); x < std::min<int64_t>(dims.x, dims.x - stepX); ++x) {
      FixedDepth& depth = own[size_t(y * dims.x + x)];
      depth = std::min(saturatingSum(depth, incoming[size_t((y + stepY) * dims.x + x + stepX)]), kLargestKeptDepth);
    }
  }
}

uint64_t sweepBytes(glm::ivec3 dims, int edge, int passCount, int threads) {
  return sweepMemory(Shape(dims, edge), passCount, threads) * sizeof(FixedDepth);
}

}  // namespace freevoxel
