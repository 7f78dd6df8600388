#include "splat/near_field.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/grid.h"

namespace freevoxel {

namespace {

/// Pieces per plane, as sweeps have them.
constexpr int kSteps = 2;

constexpr int kCubeEdge = 1 << VisibleCubes::kShift;

class NearField {
 public:
  NearField(glm::ivec3 dims, const ClassificationTable& table, const Towards& towards, int planes,
            const NearFieldBox& box)
      : table_(table), towards_(towards), planes_(planes), box_(box), last_(dims - 1) {}

  uint16_t at(glm::ivec3 voxel) const {
    const glm::dvec3 u = towards_.from(voxel);
    const double largest = std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)});
    if (!(largest > 0.0)) return uint16_t(AttenuationGrid::kUnit);
    const glm::vec3 step(u / largest);
    const float length = float(glm::length(towards_.lengthFromIndex * glm::dvec3(step)));
    const float target = towards_.directional ? INFINITY : float(largest);
    // The ray ends at the target, or where it leaves the box half a voxel beyond the outermost samples.
    float leave = target;
    for (int axis = 0; axis < 3; ++axis) {
      if (step[axis] > 0.0f) leave = std::min(leave, (float(last_[axis]) + 0.5f - float(voxel[axis])) / step[axis]);
      if (step[axis] < 0.0f) leave = std::min(leave, (-0.5f - float(voxel[axis])) / step[axis]);
    }
    const float end = std::min(leave, float(planes_));
    const glm::vec3 from(voxel);
    float depth = 0.0f;
    const int pieces = int(std::ceil(end * kSteps));
    float start = place(from);
    for (int piece = 1; piece <= pieces; ++piece) {
      const float before = float(piece - 1) / kSteps, now = std::min(float(piece) / kSteps, end);
      const float next = place(from + now * step);
      depth += table_.meanExtinction(start, next) * (now - before);
      start = next;
    }
    const float beyond = end < leave ? attenuation(from + end * step) : AttenuationGrid::kUnit;
    return uint16_t(beyond * std::exp2(-depth * length) + 0.5f);
  }

 private:
  /// Trilinear interpolation of the box's numbers, clamped at the volume's border.
  float interpolate(std::span<const uint16_t> values, glm::vec3 p) const {
    const glm::vec3 inside = glm::clamp(p, glm::vec3(0.0f), glm::vec3(last_));
    const glm::ivec3 low(inside);
    const glm::vec3 t = inside - glm::vec3(low);
    const uint64_t dx = low.x < last_.x ? 1 : 0, dy = low.y < last_.y ? uint64_t(box_.size.x) : 0,
                   dz = low.z < last_.z ? uint64_t(box_.size.x) * uint64_t(box_.size.y) : 0;
    const uint16_t* at = values.data() + linearIndex(low - box_.first, box_.size);
    const auto along = [&](const uint16_t* v) { return float(v[0]) + t.x * (float(v[dx]) - float(v[0])); };
    const auto plane = [&](const uint16_t* v) {
      const float a = along(v);
      return t.y > 0.0f ? a + t.y * (along(v + dy) - a) : a;
    };
    const float a = plane(at);
    return t.z > 0.0f ? a + t.z * (plane(at + dz) - a) : a;
  }
  float place(glm::vec3 p) const { return interpolate(box_.codes, p) * table_.entriesPerCode; }
  float attenuation(glm::vec3 p) const { return interpolate(box_.far, p); }

  const ClassificationTable& table_;
  const Towards& towards_;
  const int planes_;
  const NearFieldBox& box_;
  const glm::ivec3 last_;
};

/// Whether the near field of the cube from `first` on is traced.
bool isNear(glm::ivec3 dims, const NearFieldBox& box, glm::ivec3 first, const CodeVisibility& visibility) {
  const glm::ivec3 low = glm::max(first - 2, 0), high = glm::min(first + kCubeEdge + 2, dims);
  uint16_t least = UINT16_MAX, most = 0;
  for (int z = low.z; z < high.z; ++z) {
    for (int y = low.y; y < high.y; ++y) {
      const uint16_t* row = box.codes.data() + linearIndex(glm::ivec3(low.x, y, z) - box.first, box.size);
      for (int x = 0; x < high.x - low.x; ++x) {
        least = std::min(least, row[x]);
        most = std::max(most, row[x]);
      }
    }
    if (visibility.between(least, most)) return true;
  }
  return false;
}

}  // namespace

VisibleCubes findNearCubes(const ValueGrid& grid, const CodeVisibility& visibility) {
  VisibleCubes cubes;
  cubes.dims = (grid.dims + (kCubeEdge - 1)) / kCubeEdge;
  cubes.visible.assign(voxelCount(cubes.dims), 0);
  const NearFieldBox all{glm::ivec3(0), grid.dims, grid.codes, {}};
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = 0; z < cubes.dims.z; ++z) {
    for (int y = 0; y < cubes.dims.y; ++y) {
      for (int x = 0; x < cubes.dims.x; ++x) {
        cubes.visible[linearIndex({x, y, z}, cubes.dims)] =
            isNear(grid.dims, all, glm::ivec3(x, y, z) * kCubeEdge, visibility) ? 1 : 0;
      }
    }
  }
  return cubes;
}

AttenuationGrid withNearField(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& nearCubes,
                              const Towards& towards, int planes, const AttenuationGrid& far) {
  checkEqual(far.values.size(), grid.codes.size(), "voxels of attenuation");
  const NearFieldBox all{glm::ivec3(0), grid.dims, grid.codes, far.values};
  const NearField nearField(grid.dims, table, towards, planes, all);
  AttenuationGrid result = far;
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t i = 0; i < int64_t(nearCubes.visible.size()); ++i) {
    if (nearCubes.visible[size_t(i)] == 0) continue;
    const glm::ivec3 first = glm::ivec3(int(i % nearCubes.dims.x), int(i / nearCubes.dims.x % nearCubes.dims.y),
                                        int(i / (int64_t(nearCubes.dims.x) * nearCubes.dims.y))) *
                             kCubeEdge;
    const glm::ivec3 end = glm::min(first + kCubeEdge, grid.dims);
    for (int z = first.z; z < end.z; ++z) {
      for (int y = first.y; y < end.y; ++y) {
        for (int x = first.x; x < end.x; ++x)
          result.values[linearIndex({x, y, z}, grid.dims)] = nearField.at({x, y, z});
      }
    }
  }
  return result;
}

NearFieldBox nearFieldBox(glm::ivec3 dims, glm::ivec3 origin, int edge) {
  // Interpolation looks one voxel farther than rays go, and visibility two voxels around.
  static_assert(kNearPlanes >= 2);
  NearFieldBox box;
  box.first = glm::max(origin - kNearPlanes, 0);
  box.size = glm::min(origin + edge + kNearPlanes + 1, dims) - box.first;
  return box;
}

void brickNearField(glm::ivec3 dims, const ClassificationTable& table, const CodeVisibility& visibility,
                    const Towards& towards, const NearFieldBox& box, glm::ivec3 origin, int edge,
                    std::span<uint16_t> attenuations) {
  checkEqual(box.codes.size(), voxelCount(box.size), "codes of a box");
  checkEqual(box.far.size(), voxelCount(box.size), "attenuations of a box");
  checkEqual(attenuations.size(), voxelCount(glm::ivec3(edge)), "voxels of a brick");
  const NearField nearField(dims, table, towards, kNearPlanes, box);
  const glm::ivec3 end = glm::min(origin + edge, dims);
  for (int cz = origin.z; cz < end.z; cz += kCubeEdge) {
    for (int cy = origin.y; cy < end.y; cy += kCubeEdge) {
      for (int cx = origin.x; cx < end.x; cx += kCubeEdge) {
        const glm::ivec3 first(cx, cy, cz), last = glm::min(first + kCubeEdge, end);
        const bool traced = isNear(dims, box, first, visibility);
        for (int z = first.z; z < last.z; ++z) {
          for (int y = first.y; y < last.y; ++y) {
            for (int x = first.x; x < last.x; ++x) {
              const glm::ivec3 p(x, y, z);
              attenuations[linearIndex(p - origin, glm::ivec3(edge))] =
                  traced ? nearField.at(p) : box.far[linearIndex(p - box.first, box.size)];
            }
          }
        }
      }
    }
  }
}

}  // namespace freevoxel
