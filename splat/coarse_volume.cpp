#include "splat/coarse_volume.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "base/error.h"
#include "base/first_exception.h"
#include "hierarchy/direction_lookup.h"
#include "shaders/shared/directions.h"

namespace freevoxel {

namespace {

/// Coarse volumes have no more voxels than this, so that sweeping one takes a tenth of drawing a picture.
constexpr uint64_t kMostVoxels = uint64_t(5) << 19;
constexpr uint32_t kLargestCode = 16383;
/// Where both attenuations are below this nothing is known about their ratio.
constexpr float kDark = 0.002f;

/// Fine voxels along the edge of a coarse one.
int coarseFactor(glm::ivec3 fineDims) {
  int factor = 2;
  while (voxelCount((fineDims + (factor - 1)) / factor) > kMostVoxels)
    factor *= 2;
  return factor;
}

}  // namespace

uint64_t CoarseVolume::bytesFor(glm::ivec3 fineDims) {
  const int factor = coarseFactor(fineDims);
  return voxelCount((fineDims + (factor - 1)) / factor) *
         (sizeof(float) * (2 + std::tuple_size_v<decltype(depths_)>)+2 * sizeof(uint16_t));
}

CoarseVolume::CoarseVolume(glm::ivec3 fineDims) : factor_(coarseFactor(fineDims)), fineDims_(fineDims) {
  grid_.dims = (fineDims + (factor_ - 1)) / factor_;
  extinction_.resize(voxelCount(grid_.dims));
}

CoarseVolume::CoarseVolume(const ValueGrid& grid, std::span<const Classified> ofCode) : CoarseVolume(grid.dims) {
  grid_.coding = grid.coding;
  reduce(grid, ofCode);
  finish();
}

CoarseVolume::CoarseVolume(const AttenuationFile& file, std::span<const Classified> ofCode)
    : CoarseVolume(file.dims()) {
  grid_.coding = file.coding();
  // A coarse voxel is part of one brick, or bricks are parts of it, whose sums are added in their own order.
  const int edge = file.brickEdge();
  const int side = std::max(edge / factor_, 1), inside = std::min(edge, factor_);
  std::vector<float> sums(file.brickCount() * size_t(side * side * side));
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t b = 0; b < int64_t(file.brickCount()); ++b) {
    failure.guard([&] {
      const BrickView brick = file.brick(size_t(b), DirectionSet(0));
      const glm::ivec3 extent = glm::min(glm::ivec3(edge), file.dims() - brick.origin);
      float* own = sums.data() + size_t(b) * size_t(side * side * side);
      for (int z = 0; z < extent.z; ++z) {
        for (int y = 0; y < extent.y; ++y) {
          for (int x = 0; x < extent.x; ++x) {
            const size_t step = brick.steps[size_t((z * edge + y) * edge + x)];
            const uint32_t code = std::min(brick.code(step), file.coding().largest);
            own[(z / inside * side + y / inside) * side + x / inside] += ofCode[code].extinction;
          }
        }
      }
      file.checkIntact();
    });
  }
  failure.rethrow();
  for (size_t b = 0; b < file.brickCount(); ++b) {
    const glm::ivec3 first = file.brickOrigin(b) / factor_;
    for (int i = 0; i < side * side * side; ++i) {
      const glm::ivec3 p = first + glm::ivec3(i % side, i / side % side, i / (side * side));
      if (p.x < grid_.dims.x && p.y < grid_.dims.y && p.z < grid_.dims.z)
        extinction_[linearIndex(p, grid_.dims)] += sums[b * size_t(side * side * side) + size_t(i)];
    }
  }
  // Whole cubes count, at the border too: what lies beyond it is empty. One coarse edge is `factor` fine ones.
  for (float& sum : extinction_)
    sum /= float(factor_ * factor_) * std::numbers::ln2_v<float>;
  finish();
}

void CoarseVolume::reduce(const ValueGrid& grid, std::span<const Classified> ofCode) {
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < grid_.dims.z; ++z) {
    for (int y = 0; y < grid_.dims.y; ++y) {
      for (int x = 0; x < grid_.dims.x; ++x) {
        const glm::ivec3 first = glm::ivec3(x, y, z) * factor_, last = glm::min(first + factor_, grid.dims);
        float sum = 0.0f;
        for (int fineZ = first.z; fineZ < last.z; ++fineZ) {
          for (int fineY = first.y; fineY < last.y; ++fineY) {
            uint64_t at = linearIndex({first.x, fineY, fineZ}, grid.dims);
            for (int fineX = first.x; fineX < last.x; ++fineX, ++at)
              sum += ofCode[grid.codes[at]].extinction;
          }
        }
        extinction_[linearIndex({x, y, z}, grid_.dims)] = sum / (float(factor_ * factor_) * std::numbers::ln2_v<float>);
      }
    }
  }
}

void CoarseVolume::finish() {
  const float largest = std::max(*std::max_element(extinction_.begin(), extinction_.end()), 1e-6f);
  grid_.coding.largest = kLargestCode;
  grid_.codes.resize(extinction_.size());
  const glm::ivec3 cubeDims = (grid_.dims + 7) / 8;
  static_assert(VisibleCubes::kShift == 3);
  cubes_.dims = cubeDims;
  cubes_.visible.assign(voxelCount(cubeDims), 0);
  for (int z = 0; z < grid_.dims.z; ++z) {
    for (int y = 0; y < grid_.dims.y; ++y) {
      for (int x = 0; x < grid_.dims.x; ++x) {
        const uint64_t at = linearIndex({x, y, z}, grid_.dims);
        grid_.codes[at] = uint16_t(extinction_[at] / largest * float(kLargestCode) + 0.5f);
        if (grid_.codes[at] == 0) continue;
        // A ray may pass a cell in one cube whose corner lies in the next.
        for (int corner = 0; corner < 8; ++corner) {
          const glm::ivec3 p(x + ((corner & 1) ? 1 : -1), y + ((corner & 2) ? 1 : -1), z + ((corner & 4) ? 1 : -1));
          cubes_.visible[linearIndex(glm::clamp(p, glm::ivec3(0), grid_.dims - 1) / 8, cubeDims)] = 1;
        }
      }
    }
  }
  table_.entriesPerCode = 1.0f;
  table_.integral.resize(kLargestCode + 1);
  table_.density.resize(kLargestCode + 1);
  double sum = 0.0;
  for (uint32_t code = 0; code <= kLargestCode; ++code) {
    const double here = double(largest) * (std::min(double(code) + 0.5, double(kLargestCode))) / kLargestCode;
    table_.integral[code].extinction = float(sum);
    table_.density[code].extinction = float(here);
    sum += here;
  }
  sweepDirections();
}

void CoarseVolume::sweepDirections() {
  const glm::ivec3 dims = grid_.dims;
#pragma omp parallel for schedule(dynamic, 1)
  for (int d = 0; d < shared::kDirectionCount; ++d) {
    const glm::ivec3 step(shared::directionX(d), shared::directionY(d), shared::directionZ(d));
    std::vector<float>& depths = depths_[size_t(d)];
    depths.resize(extinction_.size());
    // The neighbour towards the outside comes first.
    const auto ordered = [&](int axis, int n) { return step[axis] > 0 ? dims[axis] - 1 - n : n; };
    const int64_t offset = step.x + int64_t(dims.x) * (step.y + int64_t(dims.y) * step.z);
    for (int nz = 0; nz < dims.z; ++nz) {
      for (int ny = 0; ny < dims.y; ++ny) {
        const int y = ordered(1, ny), z = ordered(2, nz);
        const bool rowOutside = y + step.y < 0 || y + step.y >= dims.y || z + step.z < 0 || z + step.z >= dims.z;
        for (int nx = 0; nx < dims.x; ++nx) {
          const int x = ordered(0, nx);
          const uint64_t at = linearIndex({x, y, z}, dims);
          if (rowOutside || x + step.x < 0 || x + step.x >= dims.x) {
            depths[at] = 0.5f * extinction_[at];
          } else {
            const uint64_t next = uint64_t(int64_t(at) + offset);
            depths[at] = depths[next] + 0.5f * (extinction_[at] + extinction_[next]);
          }
        }
      }
    }
  }
}

CoarseRatio CoarseVolume::ratio(const Towards& towards) const {
  // The middle of coarse voxel c is fine position factor c + (factor - 1) / 2. Lengths count edges of either kind.
  Towards coarse = towards;
  if (!towards.directional) coarse.index = (towards.index - 0.5 * (factor_ - 1)) / double(factor_);
  const AttenuationGrid swept = sweptAttenuation(grid_, table_, cubes_, coarse);
  CoarseRatio result;
  result.factor_ = factor_;
  result.dims_ = grid_.dims;
  result.ratios_.resize(extinction_.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < grid_.dims.z; ++z) {
    for (int y = 0; y < grid_.dims.y; ++y) {
      for (int x = 0; x < grid_.dims.x; ++x) {
        const uint64_t at = linearIndex({x, y, z}, grid_.dims);
        const glm::dvec3 u = coarse.from({x, y, z});
        const double largest = std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)});
        result.ratios_[at] = 1.0f;
        if (largest == 0.0) continue;
        const DirectionTriangle triangle = directionTriangle(u);
        const std::array<float, 3> weights = directionWeights(triangle, u);
        const float length = float(glm::length(coarse.lengthFromIndex * u) / largest);
        float interpolated = 0.0f;
        for (size_t k = 0; k < 3; ++k)
          interpolated += weights[k] * std::exp2(-length * depths_[size_t(triangle.index[k])][at]);
        const float exact = float(swept.values[at]) * (1.0f / AttenuationGrid::kUnit);
        result.ratios_[at] = (exact + kDark) / (interpolated + kDark);
      }
    }
  }
  return result;
}

void CoarseVolume::correct(const Towards& towards, AttenuationGrid& attenuation) const {
  const CoarseRatio ofTarget = ratio(towards);
  const size_t planeVoxels = size_t(fineDims_.x) * size_t(fineDims_.y);
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < fineDims_.z; ++z) {
    ofTarget.correct({0, 0, z}, {fineDims_.x, fineDims_.y, 1}, 0,
                     std::span(attenuation.values).subspan(size_t(z) * planeVoxels, planeVoxels));
  }
}

void CoarseRatio::correct(glm::ivec3 first, glm::ivec3 size, int level, std::span<uint16_t> attenuations) const {
  checkEqual(uint64_t(attenuations.size()), voxelCount(size), "voxels of a box");
  struct Place {
    int low, high;
    float t;
  };
  const double voxels = double(1 << level);
  const auto place = [&](int voxel, int count) {
    const double fine = voxel * voxels + 0.5 * (voxels - 1.0);
    const float at = std::clamp(float((fine - 0.5 * (factor_ - 1)) / factor_), 0.0f, float(count - 1));
    const int low = std::min(int(at), std::max(count - 2, 0));
    return Place{low, std::min(low + 1, count - 1), at - float(low)};
  };
  std::vector<Place> columns;
  for (int x = 0; x < size.x; ++x)
    columns.push_back(place(first.x + x, dims_.x));
  const int firstColumn = columns.front().low, lastColumn = columns.back().high;
  std::vector<float> row(size_t(lastColumn - firstColumn + 1));
  uint16_t* values = attenuations.data();
  for (int z = 0; z < size.z; ++z) {
    const Place inZ = place(first.z + z, dims_.z);
    for (int y = 0; y < size.y; ++y, values += size.x) {
      const Place inY = place(first.y + y, dims_.y);
      const float* rows[4] = {ratios_.data() + linearIndex({firstColumn, inY.low, inZ.low}, dims_),
                              ratios_.data() + linearIndex({firstColumn, inY.high, inZ.low}, dims_),
                              ratios_.data() + linearIndex({firstColumn, inY.low, inZ.high}, dims_),
                              ratios_.data() + linearIndex({firstColumn, inY.high, inZ.high}, dims_)};
      for (size_t x = 0; x < row.size(); ++x) {
        const float low = rows[0][x] + inY.t * (rows[1][x] - rows[0][x]);
        const float high = rows[2][x] + inY.t * (rows[3][x] - rows[2][x]);
        row[x] = low + inZ.t * (high - low);
      }
      for (int x = 0; x < size.x; ++x) {
        const Place& inX = columns[size_t(x)];
        const float low = row[size_t(inX.low - firstColumn)], high = row[size_t(inX.high - firstColumn)];
        const float factor = low + inX.t * (high - low);
        values[x] = uint16_t(std::min(float(values[x]) * factor + 0.5f, AttenuationGrid::kUnit));
      }
    }
  }
}

}  // namespace freevoxel
