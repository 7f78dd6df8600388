// A scene in the VoxLink buffer, and the plain C++ that puts it there.
#pragma once

#include <cstdint>
#include <vector>

#include "voxlink/buffers.h"
#include "voxlink/scene_voxels.h"

namespace freevoxel {

/// Invariant: voxels has one word more than there are stored voxels; those of voxel i are fragments voxels[i] up to
/// voxels[i + 1], at least one.
struct SceneBuffers : BrickLists {
  std::vector<uint32_t> voxels;
  std::vector<SceneFragment> fragments;

  uint64_t storedVoxels() const { return voxels.empty() ? 0 : voxels.size() - 1; }
  uint64_t bytes(const SceneVoxels& scene) const {
    return listBytes() + voxels.size() * sizeof(uint32_t) + fragments.size() * sizeof(SceneFragment) +
           sceneTableBytes(scene);
  }
  /// Of what fragments refer to.
  static uint64_t sceneTableBytes(const SceneVoxels& scene) {
    return scene.materials.size() * sizeof(SurfaceMaterial) + scene.spheres.size() * sizeof(SceneSphere) +
           scene.volumeMaterials.size() * sizeof(VoxelMaterial) + scene.firstOfVolume.size() * sizeof(uint32_t);
  }
};

/// By the rule of docs/voxlink.md. Same bytes for any thread count, and the bytes that GlScene builds. Throws
/// InputError if nothing is stored or there are more voxels or fragments than 32 bits can name. `degenerate`: triangles
/// left out.
SceneBuffers buildSceneBuffers(const SceneVoxels& scene, int brickEdge, uint64_t& degenerate);

}  // namespace freevoxel
