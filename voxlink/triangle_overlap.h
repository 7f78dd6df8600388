// Which voxels a triangle touches, exactly (docs/voxlink.md, the rule).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "shaders/shared/scene_voxel.h"

namespace freevoxel {

/// A triangle on the grid of 1/256 voxel: coordinates in subvoxels, 0 <= each <= 2^20 (4096 voxels).
///
/// Closed triangles against closed boxes, by separating axes: the axes of the box, the triangle's normal, and in each
/// of the three projections along an axis the normals of its edges. All in 64-bit integers: edges take 21 bits, the
/// normal 42, its product with a distance 63 at most.
class SnappedTriangle {
 public:
  explicit SnappedTriangle(const std::array<glm::ivec3, 3>& vertices) : vertex_(vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      low_[axis] = std::min({vertex_[0][axis], vertex_[1][axis], vertex_[2][axis]});
      high_[axis] = std::max({vertex_[0][axis], vertex_[1][axis], vertex_[2][axis]});
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      normal_[size_t(axis)] = int64_t(vertex_[1][u] - vertex_[0][u]) * int64_t(vertex_[2][v] - vertex_[0][v]) -
                              int64_t(vertex_[1][v] - vertex_[0][v]) * int64_t(vertex_[2][u] - vertex_[0][u]);
    }
    for (int axis = 1; axis < 3; ++axis) {
      if (magnitude(normal_[size_t(axis)]) > magnitude(normal_[size_t(axis_)])) axis_ = axis;
    }
    radius_ = kHalf * (magnitude(normal_[0]) + magnitude(normal_[1]) + magnitude(normal_[2]));
    // Of the projection along `axis`: inward normals of the three edges, twofold if the projection is a line.
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const int turn = normal_[size_t(axis)] < 0 ? -1 : 1;
      for (size_t i = 0; i < 3; ++i) {
        const glm::ivec3 a = vertex_[i], b = vertex_[(i + 1) % 3];
        Edge& edge = edges_[size_t(axis)][i];
        edge.u = -turn * (b[v] - a[v]);
        edge.v = turn * (b[u] - a[u]);
        edge.offset = int64_t(edge.u) * a[u] + int64_t(edge.v) * a[v];
        edge.radius = kHalf * int64_t(std::abs(edge.u) + std::abs(edge.v));
      }
    }
  }

  /// No area: its vertices fell on a line.
  bool degenerate() const { return normal_[size_t(axis_)] == 0; }
  /// Axis of the longest component of the normal, the first of equals.
  int axis() const { return axis_; }
  uint32_t face() const { return uint32_t(axis_) + (normal_[size_t(axis_)] < 0 ? 3u : 0u); }
  const std::array<int64_t, 3>& normal() const { return normal_; }
  const std::array<glm::ivec3, 3>& vertices() const { return vertex_; }

  /// Whether it touches voxel (i,j,k).
  bool touches(glm::ivec3 voxel) const {
    const glm::ivec3 centre = voxel * shared::kSubvoxels + kHalf;
    for (int axis = 0; axis < 3; ++axis) {
      if (centre[axis] - kHalf > high_[axis] || centre[axis] + kHalf < low_[axis]) return false;
    }
    return magnitude(above(centre)) <= radius_ && touchesAlong(0, centre) && touchesAlong(1, centre) &&
           touchesAlong(2, centre);
  }

  /// normal . (place - first vertex).
  int64_t above(glm::ivec3 place) const {
    const glm::ivec3 from = place - vertex_[0];
    return normal_[0] * from.x + normal_[1] * from.y + normal_[2] * from.z;
  }

  /// Calls f(voxel) for every voxel it touches inside a grid of `dims` voxels, columns along its axis one by one.
  template <class F>
  void forEachVoxel(glm::ivec3 dims, const F& f) const {
    const int u = (axis_ + 1) % 3, v = (axis_ + 2) % 3;
    const glm::ivec3 first = glm::ivec3(firstVoxel(low_.x), firstVoxel(low_.y), firstVoxel(low_.z));
    const glm::ivec3 last(std::min(high_.x / shared::kSubvoxels, dims.x - 1),
                          std::min(high_.y / shared::kSubvoxels, dims.y - 1),
                          std::min(high_.z / shared::kSubvoxels, dims.z - 1));
    glm::ivec3 voxel;
    for (voxel[v] = first[v]; voxel[v] <= last[v]; ++voxel[v]) {
      for (voxel[u] = first[u]; voxel[u] <= last[u]; ++voxel[u]) {
        voxel[axis_] = first[axis_];
        glm::ivec3 centre = voxel * shared::kSubvoxels + kHalf;
        if (!touchesAlong(axis_, centre)) continue;
        // Heights of the plane over the column's square, a voxel more on either side.
        const double height = -double(above(centre)) / double(normal_[size_t(axis_)]);
        const int middle = int(std::floor((double(centre[axis_]) + height) / shared::kSubvoxels));
        const int from = std::max(first[axis_], middle - 2), to = std::min(last[axis_], middle + 2);
        for (voxel[axis_] = from; voxel[axis_] <= to; ++voxel[axis_]) {
          if (touches(voxel)) f(voxel);
        }
      }
    }
  }

 private:
  static constexpr int kHalf = shared::kSubvoxels / 2;
  struct Edge {
    int u = 0, v = 0;
    int64_t offset = 0, radius = 0;
  };
  static int64_t magnitude(int64_t x) { return x < 0 ? -x : x; }
  /// First voxel whose closed box reaches up to a place.
  static int firstVoxel(int place) { return std::max(0, (place + shared::kSubvoxels - 1) / shared::kSubvoxels - 1); }

  bool touchesAlong(int axis, glm::ivec3 centre) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const bool line = normal_[size_t(axis)] == 0;
    for (const Edge& edge : edges_[size_t(axis)]) {
      const int64_t inside = int64_t(edge.u) * centre[u] + int64_t(edge.v) * centre[v] - edge.offset;
      if (inside < -edge.radius || (line && inside > edge.radius)) return false;
    }
    return true;
  }

  std::array<glm::ivec3, 3> vertex_;
  glm::ivec3 low_{0}, high_{0};
  std::array<int64_t, 3> normal_{};
  int axis_ = 0;
  int64_t radius_ = 0;
  std::array<std::array<Edge, 3>, 3> edges_{};
};

}  // namespace freevoxel
