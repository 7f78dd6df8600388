// Meshes, spheres and volumes in one VoxLink buffer, traced with reflection, refraction and shadow rays
// (papers/voxlink sections 3.1.1, 3.1.2 and 5.2; docs/voxlink.md).
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/camera.h"
#include "base/image.h"
#include "base/light.h"
#include "base/placement.h"
#include "base/progress.h"
#include "gl/context.h"
#include "hierarchy/value_grid.h"
#include "volume/transfer_function.h"
#include "voxlink/image_rows.h"
#include "voxlink/mesh.h"
#include "voxlink/shadows.h"
#include "voxlink/spheres.h"

namespace freevoxel {

/// A volume in a scene. `transfer` is what `grid` was coded for.
struct SceneVolume {
  ValueGrid grid;
  TransferFunction transfer;
};

/// What is traced together, all of it in one world space.
struct TracedScene {
  Mesh mesh;
  Spheres spheres;
  std::vector<SceneVolume> volumes;
};

/// Box in world space round everything. Throws InputError if there is nothing, or a coordinate that is no number.
Box sceneBounds(const TracedScene& scene);

struct SceneVoxLinkOptions {
  int resolution = 256;    ///< voxels along the longest edge of the scene, 1 to kMostResolution; voxels are cubes
  int brickEdge = 8;       ///< voxels: 4, 8 or 16
  double threshold = 0.0;  ///< voxels of volumes of more opacity (per reference length) are stored; 0 <= threshold < 1
  int steps = 512;         ///< of a ray per pass on the GPU, 1 to GlScene::kMostSteps
  int maxDepth = 8;        ///< how often a ray may be reflected or refracted, 0 to kMostDepth
  uint64_t gpuMemory = uint64_t(4) << 30;   ///< bytes that may be allocated there
  uint64_t rayBuffer = uint64_t(64) << 20;  ///< bytes of it for rays; fewer mean more passes

  static constexpr int kMostResolution = 4096;
  static constexpr int kMostDepth = 64;
};

struct SceneVoxLinkStatistics {
  std::string backend;        ///< "gl" or "cpu"
  std::string glRenderer;     ///< empty for cpu
  uint64_t voxels = 0;        ///< of the box
  uint64_t storedVoxels = 0;  ///< with anything in them
  uint64_t fragments = 0;     ///< several in a voxel count each
  uint64_t bricks = 0;        ///< of the grid over the stored voxels
  uint64_t occupiedBricks = 0;
  uint64_t bufferBytes = 0;          ///< of everything that tracing reads
  uint64_t degenerateTriangles = 0;  ///< left out: no area once vertices are snapped to 1/256 voxel
  uint64_t rays = 0;                 ///< of the last picture, those that were stored for a later pass among them
  int passes = 0;                    ///< of the last picture
  double buildSeconds = 0, shadowSeconds = 0, traceSeconds = 0;  ///< sums over all calls
};

/// A scene in buffers. Move-only.
class SceneVoxLink {
 public:
  /// Without a context everything is done by plain C++; with one, which must be current and outlive it, by OpenGL. The
  /// scene is not needed afterwards, but for `update`. Throws InputError (options, nothing to store, no numbers) or
  /// MachineError (memory).
  SceneVoxLink(const TracedScene& scene, const SceneVoxLinkOptions& options, const gl::Context* context,
               Progress& progress);
  ~SceneVoxLink();
  SceneVoxLink(SceneVoxLink&& other) noexcept;
  SceneVoxLink& operator=(SceneVoxLink&&) = delete;

  /// Voxelises again, for scenes that move (papers/voxlink Table 2): the box stays that of the first scene if
  /// everything is inside it. Throws as the constructor.
  void update(const TracedScene& scene, Progress& progress);

  /// Lamps. Surfaces ask for what reaches them by rays while tracing, voxels of volumes once, here. Throws InputError
  /// for Shadows::attenuation, which surfaces of a voxel or two do not have.
  void light(const Lighting& lighting, Shadows shadows);

  /// Premultiplied linear RGBA. Both backends agree within what floats lose.
  Image trace(const Camera& camera, Progress& progress) { return trace(camera, allRows(camera), progress); }
  /// Rows of it; of every partition of an image they have the same bits.
  Image trace(const Camera& camera, ImageRows rows, Progress& progress);

  const SceneVoxLinkStatistics& statistics() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace freevoxel
