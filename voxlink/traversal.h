// A ray through the VoxLink buffers, in plain C++ (papers/voxlink section 3.1.4).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/vec3.hpp>

#include "voxlink/buffers.h"

namespace freevoxel {

/// Walks the stored voxels that a ray passes, front to back. Voxel (i,j,k) fills the box from (i,j,k) to
/// (i,j,k) + 1: `origin` is index space shifted by half a voxel. `direction` is in voxels per unit of length, not 0.
/// Calls visit(number of the stored voxel, voxel, from, to) with positions along the ray, from >= `start`, until it
/// returns false.
///
/// Empty bricks are passed in one step, and so is the rest of a column, a list along z, without a filled voxel.
template <class Visit>
void traverse(const BrickLists& buffers, glm::dvec3 origin, glm::dvec3 direction, double start, Visit&& visit) {
  const BrickGrid& grid = buffers.grid;
  glm::dvec3 inverse;
  double t = start, leave = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    const double least = double(shared::kLeastComponent);
    if (std::abs(direction[axis]) < least) direction[axis] = std::copysign(least, direction[axis]);
    inverse[axis] = 1.0 / direction[axis];
    const double a = (grid.low[axis] - origin[axis]) * inverse[axis];
    const double b = (grid.high[axis] - origin[axis]) * inverse[axis];
    t = std::max(t, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (!(t < leave)) return;
  glm::ivec3 voxel;
  for (int axis = 0; axis < 3; ++axis)
    voxel[axis] = std::clamp(int(std::floor(origin[axis] + t * direction[axis])), grid.low[axis], grid.high[axis] - 1);

  const auto planeAt = [&](int axis, int plane) { return (plane - origin[axis]) * inverse[axis]; };
  const auto inside = [&](int axis) { return voxel[axis] >= grid.low[axis] && voxel[axis] < grid.high[axis]; };
  /// Where the ray is on an axis at t, kept inside a range of voxels.
  const auto follow = [&](int axis, int low, int high) {
    voxel[axis] = std::clamp(int(std::floor(origin[axis] + t * direction[axis])), low, high);
  };
  const int edge = grid.edge, shift = std::countr_zero(uint32_t(edge));
  const bool up = direction.z > 0.0;
  glm::ivec3 brick(-1);
  const uint32_t* header = nullptr;
  for (;;) {
    const glm::ivec3 here(voxel.x >> shift, voxel.y >> shift, voxel.z >> shift);
    if (here != brick) {
      brick = here;
      header = buffers.header(brick);
    }
    const glm::ivec3 first = brick * edge;
    if (header == nullptr) {
      double nearest = INFINITY;
      int axis = 0;
      for (int a = 0; a < 3; ++a) {
        const double exit = planeAt(a, direction[a] > 0.0 ? first[a] + edge : first[a]);
        if (exit < nearest) {
          nearest = exit;
          axis = a;
        }
      }
      t = std::max(t, nearest);
      for (int a = 0; a < 3; ++a) {
        if (a == axis) {
          voxel[a] = direction[a] > 0.0 ? first[a] + edge : first[a] - 1;
        } else if (direction[a] > 0.0) {
          follow(a, voxel[a], first[a] + edge - 1);
        } else {
          follow(a, first[a], voxel[a]);
        }
      }
      if (!inside(axis)) return;
      continue;
    }

    const int column = (voxel.y - first.y) * edge + (voxel.x - first.x);
    const int localZ = voxel.z - first.z;
    // Voxels of the list from here on, the way the ray goes.
    const uint32_t mask = listMask(header, edge, column);
    const uint32_t ahead = up ? mask >> localZ << localZ : mask & ((2u << localZ) - 1u);
    const double exitX = planeAt(0, direction.x > 0.0 ? voxel.x + 1 : voxel.x);
    const double exitY = planeAt(1, direction.y > 0.0 ? voxel.y + 1 : voxel.y);
    const double exit = std::min(exitX, exitY);
    double exitZ = planeAt(2, up ? first.z + edge : first.z);
    int nextZ = up ? first.z + edge : first.z - 1;
    if (ahead != 0) {
      const int bit = up ? std::countr_zero(ahead) : 31 - std::countl_zero(ahead);
      const double enter = bit == localZ ? t : planeAt(2, up ? first.z + bit : first.z + bit + 1);
      if (enter < exit) {
        exitZ = planeAt(2, up ? first.z + bit + 1 : first.z + bit);
        nextZ = up ? first.z + bit + 1 : first.z + bit - 1;
        voxel.z = first.z + bit;
        const double to = std::min(exit, exitZ);
        if (!visit(storedVoxel(header, edge, column * edge + bit), voxel, enter, std::max(enter, to))) return;
        t = std::max(t, enter);
      }
    }
    if (exitZ <= exit) {
      t = std::max(t, exitZ);
      voxel.z = nextZ;
      if (!inside(2)) return;
    } else {
      t = std::max(t, exit);
      if (up) {
        follow(2, voxel.z, nextZ - 1);
      } else {
        follow(2, nextZ + 1, voxel.z);
      }
      const int axis = exitX <= exitY ? 0 : 1;
      voxel[axis] += direction[axis] > 0.0 ? 1 : -1;
      if (!inside(axis)) return;
    }
  }
}

}  // namespace freevoxel
