// Attenuation of every voxel towards one point or direction: the eye or a light.
#pragma once

#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "base/placement.h"
#include "hierarchy/value_grid.h"
#include "splat/classification_table.h"
#include "volume/transfer_function.h"

namespace freevoxel {

/// Where attenuation is wanted towards, in index space.
struct Towards {
  bool directional = false;
  glm::dvec3 index{0.0};            ///< a position, or, if directional, a direction of any length
  glm::dmat3 lengthFromIndex{1.0};  ///< columns: the voxel edges, in shortest voxel edges

  static Towards point(const Placement& placement, glm::dvec3 world);
  static Towards direction(const Placement& placement, glm::dvec3 world);

  /// The same in the index space of a level's voxels (0: this one): voxel p of level k lies at 2^k p + (2^k - 1) / 2.
  Towards ofLevel(int level) const;

  /// From a voxel to the target, in index units; not of unit length.
  glm::dvec3 from(glm::dvec3 voxel) const { return directional ? index : index - voxel; }
  /// Whether the target is a point in the box of a volume, which reaches half a voxel beyond its samples.
  bool inside(glm::ivec3 dims) const;
  bool operator==(const Towards&) const = default;
};

/// Attenuation as 0..65535, x fastest.
struct AttenuationGrid {
  static constexpr float kUnit = 65535.0f;
  std::vector<uint16_t> values;
  /// Faces of the volume's box, lower and upper along each axis, that light from within passes on its way to the
  /// target.
  glm::bvec3 openLow{false}, openHigh{false};

  void setOpenFaces(const Towards& towards, glm::ivec3 dims);
};

/// Cubes of 8 voxels an edge in which, or within a cell of which, something is visible; x fastest.
struct VisibleCubes {
  static constexpr int kShift = 3;
  glm::ivec3 dims{0};
  std::vector<uint8_t> visible;
};
VisibleCubes findVisibleCubes(const ValueGrid& grid, const TransferFunction& transfer);

/// Swept plane by plane from the target (DESIGN section 3, `swept`): the attenuation of the plane nearer to it,
/// interpolated where the ray crosses, times what the segment between takes, its value running linearly. A target
/// inside the volume is allowed. Same values for any thread count.
AttenuationGrid sweptAttenuation(const ValueGrid& grid, const ClassificationTable& table, const VisibleCubes& cubes,
                                 const Towards& towards);

}  // namespace freevoxel
