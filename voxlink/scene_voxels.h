// A scene as whatever voxelises it takes it: a grid of cubes, and triangles, spheres and samples of volumes on it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/placement.h"
#include "shaders/shared/scene_voxel.h"
#include "shaders/shared/voxlink.h"
#include "voxlink/scene.h"

namespace freevoxel {

using shared::SceneFragment;
using shared::SceneSphere;
using shared::SurfaceMaterial;
static_assert(sizeof(SceneFragment) == 8 && sizeof(SurfaceMaterial) == 32 && sizeof(SceneSphere) == 20);

/// Cubes of equal size along the axes of the world. Voxel (i,j,k) fills the box from (i,j,k) to (i,j,k) + 1, in voxels
/// from `origin`.
struct SceneGrid {
  glm::ivec3 dims{0};
  glm::vec3 origin{0.0f};
  double edge = 1.0;  ///< of a voxel, in world lengths

  float scale() const { return float(double(shared::kSubvoxels) / edge); }  ///< subvoxels per world length
  glm::dvec3 voxelsFromWorld(glm::dvec3 world) const { return (world - glm::dvec3(origin)) / edge; }
  glm::ivec3 snapped(glm::vec3 world) const {
    return {shared::snapped(world.x, origin.x, scale()), shared::snapped(world.y, origin.y, scale()),
            shared::snapped(world.z, origin.z, scale())};
  }
  Box bounds() const { return {glm::dvec3(origin), glm::dvec3(origin) + glm::dvec3(dims) * edge}; }
};

/// The grid round a box whose longest edge has `resolution` voxels.
SceneGrid sceneGrid(const Box& box, int resolution);

/// A voxel that a volume fills, by the value at its centre.
struct VolumeSample {
  std::array<uint16_t, 3> voxel{};
  uint16_t volume = 0;
  uint32_t body = 0;  ///< shared::fragmentOf
};

/// What there is to voxelise. `mesh` refers to the scene it was made from.
struct SceneVoxels {
  SceneGrid grid;
  const Mesh* mesh = nullptr;
  std::vector<SurfaceMaterial> materials;  ///< the mesh's, then the spheres'
  std::vector<SceneSphere> spheres;
  std::vector<VolumeSample> samples;           ///< by volume and slice
  std::vector<VoxelMaterial> volumeMaterials;  ///< of every code of every volume, extinction per voxel
  std::vector<uint32_t> firstOfVolume;         ///< of its materials, one per volume
};

/// Throws InputError for materials, indices or numbers that make no sense, and for more than can be named.
SceneVoxels sceneVoxels(const TracedScene& scene, const SceneGrid& grid, double threshold);

/// The box that a sphere's surface may touch, in voxels of the grid, both ends included; it may be empty.
struct VoxelRange {
  glm::ivec3 first, last;
};
/// Centre and radius snapped to the grid of subvoxels.
struct SnappedSphere {
  glm::ivec3 centre;
  int radius;
};
SnappedSphere snappedSphere(const SceneSphere& sphere);
VoxelRange rangeOf(const SnappedSphere& sphere, glm::ivec3 dims);
/// Whether a voxel may hold a part of the sphere's surface: its closed box has places both nearer and farther than the
/// radius, give or take two subvoxels for the snapping.
bool touches(const SnappedSphere& sphere, glm::ivec3 voxel);

}  // namespace freevoxel
