// Where a grid of voxels lies in world space.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace freevoxel {

/// Voxel (i,j,k), a sample, lies at origin + direction * ((i,j,k) * spacing), in the file's length unit.
/// Invariant: spacing > 0 and finite; direction's columns are the unit vectors of the index axes in world space and are
/// linearly independent (orthogonal in almost every file; a left-handed set mirrors the data).
struct Placement {
  glm::dvec3 spacing{1.0};
  glm::dvec3 origin{0.0};
  glm::dmat3 direction{1.0};

  /// Shortest voxel edge, the renderer's unit of length (DESIGN: h = spacing / min(spacing)).
  double unitLength() const;
  /// Column vectors; maps voxel indices (a sample at each integer point) to world space.
  glm::dmat4 worldFromIndex() const;
  /// Throws InternalError if the invariant does not hold.
  void check() const;
};

/// Axis-aligned box in world space.
struct Box {
  glm::dvec3 lower, upper;
  glm::dvec3 centre() const { return 0.5 * (lower + upper); }
  glm::dvec3 extent() const { return upper - lower; }
};

/// Bounds in world space of a grid: the box reaches half a voxel beyond the outermost samples.
Box worldBounds(const Placement& placement, glm::ivec3 dims);

}  // namespace freevoxel
