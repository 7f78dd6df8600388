// The plain C++ tracer of scenes: the CPU backend, and the oracle of the one on the GPU (papers/voxlink section 5.2).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/camera.h"
#include "base/image.h"
#include "base/light.h"
#include "base/progress.h"
#include "voxlink/image_rows.h"
#include "voxlink/scene_buffers.h"
#include "voxlink/scene_light.h"

namespace freevoxel {

/// What of each lamp's light reaches the centre of each voxel that a volume fills, by a ray: lamp after lamp, a byte
/// per fragment; empty without volumes. Surfaces on the way take what splitRay leaves for shadow rays. Same bytes for
/// any thread count.
LightShares volumeShares(const SceneBuffers& buffers, const SceneVoxels& scene, const Lighting& lighting,
                         Shadows shadows);

/// Light that volumes' fragments send to the eye, packed (shared::packLight), one per fragment; empty without volumes.
std::vector<uint32_t> lightVolumes(const SceneBuffers& buffers, const SceneVoxels& scene, const Lighting& lighting,
                                   const LightShares& shares, const Camera& camera);

struct SceneTracing {
  Lighting lighting;
  Shadows shadows = Shadows::rays;  ///< of surfaces: rays or none
  int maxDepth = 8;                 ///< how often a ray may be reflected or refracted
};

/// Premultiplied linear RGBA of the rows. `light` is lightVolumes. `rays`: view, reflected and shadow rays. Same bytes
/// for any thread count.
Image traceScene(const SceneBuffers& buffers, const SceneVoxels& scene, std::span<const uint32_t> light,
                 const SceneTracing& tracing, const Camera& camera, ImageRows rows, uint64_t& rays, Progress& progress);

}  // namespace freevoxel
