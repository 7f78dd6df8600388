#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <vector>

#include "splat/attenuation_grid.h"
#include "splat/visible_blocks.h"

namespace freevoxel {

namespace {

/// Rays beside a pyramid that are traced with it, so that interpolation at its sides finds neighbours.
constexpr double kMargin = 2.0;

/// Samples per plane along each ray: a piece of a ray between two planes bends where it passes from cell to cell.
constexpr int kSteps = 2;

/// Planes before a voxel through which its own ray is traced; what lies beyond is interpolated among the lattice's
/// rays.
constexpr size_t kNearPlanes = 3;

/// One of the six pyramids of voxels that see the target mostly along one axis, swept from the target outwards.
///
/// The sweep carries its state along rays from the target, a lattice of them one voxel apart on the farthest plane, and
/// interpolates once, from the rays to a voxel. Carrying it from voxel to voxel instead would interpolate at every
/// plane and blur shadows by several voxels.
class PyramidSweep {
 public:
  PyramidSweep(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& cubes,
               const Towards& towards, int axis, int side, AttenuationGrid& result)
      : grid_(grid),
        table_(table),
        cubes_(cubes),
        towards_(towards),
        a_(axis),
        b_((axis + 1) % 3),
        c_((axis + 2) % 3),
        side_(side),
        result_(result) {
    const int64_t strides[3] = {1, grid.dims.x, int64_t(grid.dims.x) * grid.dims.y};
    strideA_ = strides[a_];
    strideB_ = strides[b_];
    strideC_ = strides[c_];
    const int64_t cubeStrides[3] = {1, cubes.dims.x, int64_t(cubes.dims.x) * cubes.dims.y};
    cubeStrideA_ = cubeStrides[a_];
    cubeStrideB_ = cubeStrides[b_];
    cubeStrideC_ = cubeStrides[c_];
    sizeA_ = grid.dims[a_];
    sizeB_ = grid.dims[b_];
    sizeC_ = grid.dims[c_];
  }

  void run() {
    const int nearest = side_ > 0 ? sizeA_ - 1 : 0, farthest = side_ > 0 ? 0 : sizeA_ - 1;
    farDistance_ = distanceOf(farthest);
    if (farDistance_ <= 0.0) return;  // the target lies beyond the last plane
    if (!findRays()) return;
    // Rays do not know of each other, so bands of them run through all planes without waiting. A band traces one row
    // more than it stores from, for interpolation.
    const int bands = (raysC_ + kBandRows - 1) / kBandRows;
#pragma omp parallel for schedule(dynamic, 1)
    for (int band = 0; band < bands; ++band) {
      Band rays{band * kBandRows, std::min((band + 1) * kBandRows, raysC_ - 1), {}, {}, {}};
      if (rays.first >= rays.last) continue;
      rays.attenuation.assign(size_t(rays.last - rays.first + 1) * size_t(raysB_), 1.0f);
      // Light leaves through the half voxel beyond the outermost plane, or starts at the target.
      double before = (side_ > 0 ? sizeA_ - 0.5 : -0.5);
      if (!towards_.directional && (towards_.index[a_] - before) * side_ < 0.0) before = towards_.index[a_];
      for (int n = 0; n < sizeA_; ++n) {
        const int k = nearest - side_ * n;
        if (distanceOf(k) <= 0.0) continue;
        if (rays.steps.size() == kNearPlanes) {
          std::rotate(rays.before.begin(), rays.before.begin() + 1, rays.before.end());
          rays.steps.erase(rays.steps.begin());
        } else {
          rays.before.emplace_back();
        }
        rays.before.back() = rays.attenuation;
        rays.steps.push_back(stepTo(before, k));
        traceRays(before, k, rays);
        before = k;
        storePlane(k, rays);
      }
    }
  }

 private:
  static constexpr int kBandRows = 16;
  double distanceOf(double k) const {
    return towards_.directional ? 1.0 : (towards_.index[a_] - k) * side_;
  }

  /// Where a ray that passes (b, c) of the farthest plane is at plane position s: centre + (b - centre) * scale, and
  /// for a direction b + shift.
  double scaleAt(double s) const {
    return towards_.directional ? 1.0 : distanceOf(s) / farDistance_;
  }
  double shiftAt(double s, int axis) const {
    if (!towards_.directional) return towards_.index[axis] * (1.0 - scaleAt(s));
    const int farthest = side_ > 0 ? 0 : sizeA_ - 1;
    return (s - farthest) * towards_.index[axis] / towards_.index[a_];
  }

  /// The rectangle of rays on the farthest plane that pass the volume within the pyramid. False if there are none.
  bool findRays() {
    const int ends[2] = {side_ > 0 ? sizeA_ - 1 : 0, side_ > 0 ? 0 : sizeA_ - 1};
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int lateral = 0; lateral < 2; ++lateral) {
      const int axis = lateral == 0 ? b_ : c_;
      const double size = grid_.dims[axis];
      for (const int end : ends) {
        const double s = distanceOf(end) > 0.0 ? double(end) : towards_.index[a_] - 1e-3 * side_;
        for (const double edge : {-0.5, size - 0.5}) {
          const double there = (edge - shiftAt(s, axis)) / scaleAt(s);
          low[lateral] = std::min(low[lateral], there);
          high[lateral] = std::max(high[lateral], there);
        }
      }
      if (!towards_.directional) {
        low[lateral] = std::max(low[lateral], towards_.index[axis] - farDistance_);
        high[lateral] = std::min(high[lateral], towards_.index[axis] + farDistance_);
      }
      if (!(low[lateral] < high[lateral])) return false;
    }
    firstB_ = std::floor(low[0] - kMargin);
    firstC_ = std::floor(low[1] - kMargin);
    raysB_ = int(std::ceil(high[0] + kMargin) - firstB_) + 1;
    raysC_ = int(std::ceil(high[1] + kMargin) - firstC_) + 1;
    return true;
  }

  /// The value, as a place on the table, where a ray is at plane position s = k + t side, 0 <= t <= 1.
  float placeAt(int k, float t, float b, float c) const {
    const float atB = std::clamp(b, 0.0f, float(sizeB_ - 1)), atC = std::clamp(c, 0.0f, float(sizeC_ - 1));
    const int b0 = int(atB), c0 = int(atC);
    const int64_t stepB = b0 + 1 < sizeB_ ? strideB_ : 0, stepC = c0 + 1 < sizeC_ ? strideC_ : 0;
    const float tb = atB - float(b0), tc = atC - float(c0);
    const auto plane = [&](int at) {
      const uint16_t* codes = grid_.codes.data() + at * strideA_ + b0 * strideB_ + c0 * strideC_;
      const float low = float(codes[0]) + tb * (float(codes[stepB]) - float(codes[0]));
      const float high = float(codes[stepC]) + tb * (float(codes[stepB + stepC]) - float(codes[stepC]));
      return low + tc * (high - low);
    };
    float value = plane(k);
    const int next = k + side_;
    if (t > 0.0f && next >= 0 && next < sizeA_) value += t * (plane(next) - value);
    return value * table_.entriesPerCode;
  }

  bool visibleAt(int plane, double b, double c) const {
    const int cubeB = std::clamp(int(b), 0, sizeB_ - 1) >> VisibleCubes::kShift;
    const int cubeC = std::clamp(int(c), 0, sizeC_ - 1) >> VisibleCubes::kShift;
    return cubes_.visible[size_t((plane >> VisibleCubes::kShift) * cubeStrideA_ + cubeB * cubeStrideB_ +
                                 cubeC * cubeStrideC_)] != 0;
  }

  /// The way of rays from plane position `before` to plane k: where each is there, in units of the lattice.
  struct Step {
    int k;
    double way;  ///< planes
    double scale0, scale1;
    double shiftB0, shiftB1, shiftC0, shiftC1;
    int lowerPlane;
    glm::dvec3 edgeA;
  };
  Step stepTo(double before, int k) const {
    const double way = std::abs(before - k);
    return {k,
            way,
            scaleAt(before),
            scaleAt(k),
            shiftAt(before, b_),
            shiftAt(k, b_),
            shiftAt(before, c_),
            shiftAt(k, c_),
            std::clamp(side_ > 0 ? k : k - 1, 0, sizeA_ - 1),
            towards_.lengthFromIndex[a_] * way};
  }

  /// Rows first..last of rays, and their attenuation so far; voxels between rows first and last are stored from them.
  struct Band {
    int first, last;
    std::vector<float> attenuation;
    /// The last kNearPlanes steps, the latest last, and attenuation before each.
    std::vector<Step> steps;
    std::vector<std::vector<float>> before;
  };

  /// Optical depth, in log2, of one step of the ray at (b, c) of the lattice.
  float depthOf(const Step& step, double b, double c) const {
    const double lowestB = -0.5, highestB = sizeB_ - 0.5, lowestC = -0.5, highestC = sizeC_ - 0.5;
    const double b0 = b * step.scale0 + step.shiftB0, b1 = b * step.scale1 + step.shiftB1;
    if (std::max(b0, b1) < lowestB || std::min(b0, b1) > highestB) return 0.0f;
    const double c0 = c * step.scale0 + step.shiftC0, c1 = c * step.scale1 + step.shiftC1;
    if (std::max(c0, c1) < lowestC || std::min(c0, c1) > highestC) return 0.0f;
    // Between two planes a ray moves by at most a voxel sideways, which is how far visible cubes reach out.
    if (!visibleAt(step.lowerPlane, b1, c1)) return 0.0f;
    // The share of the way that lies inside the volume.
    double from = 0.0, to = 1.0;
    const auto clip = [&](double p0, double p1, double lowest, double highest) {
      if (p0 < lowest) from = std::max(from, (lowest - p0) / (p1 - p0));
      if (p0 > highest) from = std::max(from, (highest - p0) / (p1 - p0));
      if (p1 < lowest) to = std::min(to, (lowest - p0) / (p1 - p0));
      if (p1 > highest) to = std::min(to, (highest - p0) / (p1 - p0));
    };
    clip(b0, b1, lowestB, highestB);
    clip(c0, c1, lowestC, highestC);
    if (from >= to) return 0.0f;
    const auto place = [&](double t) {
      return placeAt(step.k, float(step.way * (1.0 - t)), float(b0 + t * (b1 - b0)), float(c0 + t * (c1 - c0)));
    };
    float start = place(from);
    float extinction = 0.0f;
    for (int piece = 1; piece <= kSteps; ++piece) {
      const float end = place(from + (to - from) * piece / kSteps);
      extinction += table_.meanExtinction(start, end);
      start = end;
    }
    if (!(extinction > 0.0f)) return 0.0f;
    const double length = glm::length(step.edgeA * double(-side_) + towards_.lengthFromIndex[b_] * (b1 - b0) +
                                      towards_.lengthFromIndex[c_] * (c1 - c0));
    return extinction * float(length * (to - from) / kSteps);
  }

  /// Takes a band's rays from plane position `before` to plane k.
  void traceRays(double before, int k, Band& rays) const {
    if (before == k) return;
    const Step step = stepTo(before, k);
    const double lowestC = -0.5, highestC = sizeC_ - 0.5;
    for (int j = rays.first; j <= rays.last; ++j) {
      const double c = firstC_ + j;
      const double c0 = c * step.scale0 + step.shiftC0, c1 = c * step.scale1 + step.shiftC1;
      if (std::max(c0, c1) < lowestC || std::min(c0, c1) > highestC) continue;
      float* row = rays.attenuation.data() + size_t(j - rays.first) * size_t(raysB_);
      for (int i = 0; i < raysB_; ++i) {
        const float depth = depthOf(step, firstB_ + i, c);
        if (depth > 0.0f) row[i] *= std::exp2(-depth);
      }
    }
  }

  /// Whether the target lies mostly along this axis and side; ties go to the earlier axis.
  bool owns(double ub, double uc, double ua) const {
    const bool overB = b_ > a_ ? ua >= std::abs(ub) : ua > std::abs(ub);
    const bool overC = c_ > a_ ? ua >= std::abs(uc) : ua > std::abs(uc);
    return overB && overC;
  }

  /// Interpolates a band's attenuation at the pyramid's voxels of plane k that lie between its rows.
  void storePlane(int k, const Band& rays) const {
    const double scale = 1.0 / scaleAt(k);
    const double shiftB = shiftAt(k, b_), shiftC = shiftAt(k, c_);
    const double distance = distanceOf(k);
    const auto range = [&](int axis) {
      if (towards_.directional) return std::pair(0, grid_.dims[axis]);
      return std::pair(int(std::clamp(std::floor(towards_.index[axis] - distance), 0.0, double(grid_.dims[axis]))),
                       int(std::clamp(towards_.index[axis] + distance + 1.0, 0.0, double(grid_.dims[axis]))));
    };
    const auto [b0, b1] = range(b_);
    const auto [c0, c1] = range(c_);
    // Rays outside the volume know nothing: voxels at its border take the last ray inside.
    const auto raysInside = [&](double first, int count, double shift, int size) {
      const double low = std::ceil((-0.5 - shift) * scale - first),
                   high = std::floor((size - 0.5 - shift) * scale - first);
      return std::pair(std::clamp(low, 0.0, count - 1.0), std::clamp(high, 0.0, count - 1.0));
    };
    const auto [lowB, highB] = raysInside(firstB_, raysB_, shiftB, sizeB_);
    const auto [lowC, highC] = raysInside(firstC_, raysC_, shiftC, sizeC_);
    for (int c = c0; c < c1; ++c) {
      const float atC = float(std::max(lowC, std::min((c - shiftC) * scale - firstC_, highC)));
      const int j = std::min(int(atC), raysC_ - 2);
      if (j < rays.first || j >= rays.last) continue;
      const float tc = atC - float(j);
      const float* row = rays.before.front().data() + size_t(j - rays.first) * size_t(raysB_);
      const float* next = row + raysB_;
      uint16_t* out = result_.values.data() + int64_t(k) * strideA_ + int64_t(c) * strideC_;
      for (int b = b0; b < b1; ++b) {
        if (!towards_.directional && !owns(towards_.index[b_] - b, towards_.index[c_] - c, distance)) continue;
        const float atB = float(std::max(lowB, std::min((b - shiftB) * scale - firstB_, highB)));
        const int i = std::min(int(atB), raysB_ - 2);
        const float tb = atB - float(i);
        const float low = row[i] + tb * (row[i + 1] - row[i]), high = next[i] + tb * (next[i + 1] - next[i]);
        float attenuation = low + tc * (high - low);
        if (attenuation > 0.0f) {
          float depth = 0.0f;
          for (const Step& step : rays.steps)
            depth += depthOf(step, firstB_ + double(atB), firstC_ + double(atC));
          if (depth > 0.0f) attenuation *= std::exp2(-depth);
        }
        out[int64_t(b) * strideB_] = uint16_t(attenuation * AttenuationGrid::kUnit + 0.5f);
      }
    }
  }

  const ValueGrid& grid_;
  const ClassificationTable& table_;
  const VisibleCubes& cubes_;
  const Towards& towards_;
  const int a_, b_, c_;
  const int side_;
  AttenuationGrid& result_;
  int64_t strideA_, strideB_, strideC_;
  int64_t cubeStrideA_, cubeStrideB_, cubeStrideC_;
  int sizeA_, sizeB_, sizeC_;
  double farDistance_ = 1.0;
  double firstB_ = 0.0, firstC_ = 0.0;  ///< of the lattice of rays, on the farthest plane
  int raysB_ = 0, raysC_ = 0;
};

}  // namespace

VisibleCubes findVisibleCubes(const ValueGrid& grid, const TransferFunction& transfer) {
  constexpr int kEdge = 1 << VisibleCubes::kShift;
  VisibleCubes cubes;
  cubes.dims = (grid.dims + (kEdge - 1)) / kEdge;
  cubes.visible.assign(voxelCount(cubes.dims), 0);
  for (const VisibleBlock& block : findVisibleBlocks(grid, transfer, kEdge)) {
    cubes.visible[linearIndex(block.origin / kEdge, cubes.dims)] = 1;
  }
  return cubes;
}

AttenuationGrid sweptAttenuation(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& cubes,
                                 const Towards& towards) {
  AttenuationGrid result;
  result.values.assign(grid.codes.size(), 65535);
  result.setOpenFaces(towards, grid.dims);
  const glm::dvec3 size = glm::abs(towards.index);
  const int dominant = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      if (towards.directional && (axis != dominant || (towards.index[axis] > 0.0) != (side > 0))) continue;
      PyramidSweep(grid, table, cubes, towards, axis, side, result).run();
    }
  }
  return result;
}

}  // namespace freevoxel
