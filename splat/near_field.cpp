#include "splat/near_field.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

namespace {

/// Pieces per plane, as sweeps have them.
constexpr int kSteps = 2;

class NearField {
 public:
  NearField(const ValueGrid& grid, const ClassificationTable& table, const Towards& towards, int planes,
            const AttenuationGrid& far)
      : grid_(grid), table_(table), towards_(towards), planes_(planes), far_(far), last_(grid.dims - 1) {}

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
  /// Trilinear interpolation of a grid's numbers, clamped at its border.
  template <class T>
  float interpolate(const std::vector<T>& values, glm::vec3 p) const {
    const glm::vec3 inside = glm::clamp(p, glm::vec3(0.0f), glm::vec3(last_));
    const glm::ivec3 low(inside);
    const glm::vec3 t = inside - glm::vec3(low);
    const uint64_t dx = low.x < last_.x ? 1 : 0, dy = low.y < last_.y ? uint64_t(grid_.dims.x) : 0,
                   dz = low.z < last_.z ? uint64_t(grid_.dims.x) * uint64_t(grid_.dims.y) : 0;
    const T* at = values.data() + linearIndex(low, grid_.dims);
    const auto along = [&](const T* v) { return float(v[0]) + t.x * (float(v[dx]) - float(v[0])); };
    const auto plane = [&](const T* v) {
      const float a = along(v);
      return t.y > 0.0f ? a + t.y * (along(v + dy) - a) : a;
    };
    const float a = plane(at);
    return t.z > 0.0f ? a + t.z * (plane(at + dz) - a) : a;
  }
  float place(glm::vec3 p) const { return interpolate(grid_.codes, p) * table_.entriesPerCode; }
  float attenuation(glm::vec3 p) const { return interpolate(far_.values, p); }

  const ValueGrid& grid_;
  const ClassificationTable& table_;
  const Towards& towards_;
  const int planes_;
  const AttenuationGrid& far_;
  const glm::ivec3 last_;
};

}  // namespace

AttenuationGrid withNearField(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& cubes,
                              const Towards& towards, int planes, const AttenuationGrid& far) {
  checkEqual(far.values.size(), grid.codes.size(), "voxels of attenuation");
  const NearField nearField(grid, table, towards, planes, far);
  AttenuationGrid result = far;
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t i = 0; i < int64_t(cubes.visible.size()); ++i) {
    if (cubes.visible[size_t(i)] == 0) continue;
    constexpr int kEdge = 1 << VisibleCubes::kShift;
    const glm::ivec3 first = glm::ivec3(int(i % cubes.dims.x), int(i / cubes.dims.x % cubes.dims.y),
                                        int(i / (int64_t(cubes.dims.x) * cubes.dims.y))) *
                             kEdge;
    const glm::ivec3 end = glm::min(first + kEdge, grid.dims);
    for (int z = first.z; z < end.z; ++z) {
      for (int y = first.y; y < end.y; ++y) {
        for (int x = first.x; x < end.x; ++x)
          result.values[linearIndex({x, y, z}, grid.dims)] = nearField.at({x, y, z});
      }
    }
  }
  return result;
}

}  // namespace freevoxel
