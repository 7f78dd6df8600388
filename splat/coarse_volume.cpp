#include "splat/coarse_volume.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "hierarchy/direction_lookup.h"
#include "shaders/shared/directions.h"

namespace freevoxel {

namespace {

/// Coarse volumes have no more voxels than this, so that sweeping one takes a tenth of drawing a picture.
constexpr uint64_t kMostVoxels = uint64_t(5) << 19;
constexpr uint32_t kLargestCode = 16383;
/// Where both attenuations are below this nothing is known about their ratio.
constexpr float kDark = 0.002f;

}  // namespace

CoarseVolume::CoarseVolume(const ValueGrid& grid, std::span<const Classified> ofCode) : fineDims_(grid.dims) {
  while (voxelCount((grid.dims + (factor_ - 1)) / factor_) > kMostVoxels)
    factor_ *= 2;
  reduce(grid, ofCode);
  sweepDirections();
}

void CoarseVolume::reduce(const ValueGrid& grid, std::span<const Classified> ofCode) {
  grid_.dims = (grid.dims + (factor_ - 1)) / factor_;
  extinction_.resize(voxelCount(grid_.dims));
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
        // Whole cubes count, at the border too: what lies beyond it is empty. One coarse edge is `factor` fine ones.
        extinction_[linearIndex({x, y, z}, grid_.dims)] = sum / (float(factor_ * factor_) * std::numbers::ln2_v<float>);
      }
    }
  }
  const float largest = std::max(*std::max_element(extinction_.begin(), extinction_.end()), 1e-6f);
  grid_.coding = grid.coding;
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

std::vector<float> CoarseVolume::ratios(const Towards& coarse) const {
  const AttenuationGrid swept = sweptAttenuation(grid_, table_, cubes_, coarse);
  std::vector<float> ratios(extinction_.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < grid_.dims.z; ++z) {
    for (int y = 0; y < grid_.dims.y; ++y) {
      for (int x = 0; x < grid_.dims.x; ++x) {
        const uint64_t at = linearIndex({x, y, z}, grid_.dims);
        const glm::dvec3 u = coarse.from({x, y, z});
        const double largest = std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)});
        ratios[at] = 1.0f;
        if (largest == 0.0) continue;
        const DirectionTriangle triangle = directionTriangle(u);
        const std::array<float, 3> weights = directionWeights(triangle, u);
        const float length = float(glm::length(coarse.lengthFromIndex * u) / largest);
        float interpolated = 0.0f;
        for (size_t k = 0; k < 3; ++k)
          interpolated += weights[k] * std::exp2(-length * depths_[size_t(triangle.index[k])][at]);
        const float exact = float(swept.values[at]) * (1.0f / AttenuationGrid::kUnit);
        ratios[at] = (exact + kDark) / (interpolated + kDark);
      }
    }
  }
  return ratios;
}

void CoarseVolume::correct(const Towards& towards, AttenuationGrid& attenuation) const {
  // The middle of coarse voxel c is fine position factor c + (factor - 1) / 2. Lengths count edges of either kind.
  const double middle = 0.5 * (factor_ - 1);
  Towards coarse = towards;
  if (!towards.directional) coarse.index = (towards.index - middle) / double(factor_);
  const std::vector<float> ratio = ratios(coarse);
  struct Place {
    int low, high;
    float t;
  };
  const auto place = [&](int fine, int size) {
    const float at = std::clamp(float((fine - middle) / factor_), 0.0f, float(size - 1));
    const int low = std::min(int(at), std::max(size - 2, 0));
    return Place{low, std::min(low + 1, size - 1), at - float(low)};
  };
  std::vector<Place> columns;
  for (int x = 0; x < fineDims_.x; ++x)
    columns.push_back(place(x, grid_.dims.x));
#pragma omp parallel
  {
    std::vector<float> row(size_t(grid_.dims.x));
#pragma omp for schedule(dynamic, 1)
    for (int z = 0; z < fineDims_.z; ++z) {
      const Place inZ = place(z, grid_.dims.z);
      for (int y = 0; y < fineDims_.y; ++y) {
        const Place inY = place(y, grid_.dims.y);
        const float* rows[4] = {ratio.data() + linearIndex({0, inY.low, inZ.low}, grid_.dims),
                                ratio.data() + linearIndex({0, inY.high, inZ.low}, grid_.dims),
                                ratio.data() + linearIndex({0, inY.low, inZ.high}, grid_.dims),
                                ratio.data() + linearIndex({0, inY.high, inZ.high}, grid_.dims)};
        for (size_t x = 0; x < row.size(); ++x) {
          const float low = rows[0][x] + inY.t * (rows[1][x] - rows[0][x]);
          const float high = rows[2][x] + inY.t * (rows[3][x] - rows[2][x]);
          row[x] = low + inZ.t * (high - low);
        }
        uint16_t* values = attenuation.values.data() + linearIndex({0, y, z}, fineDims_);
        for (int x = 0; x < fineDims_.x; ++x) {
          const Place& inX = columns[size_t(x)];
          const float factor = row[size_t(inX.low)] + inX.t * (row[size_t(inX.high)] - row[size_t(inX.low)]);
          values[x] = uint16_t(std::min(float(values[x]) * factor + 0.5f, AttenuationGrid::kUnit));
        }
      }
    }
  }
}

}  // namespace freevoxel
