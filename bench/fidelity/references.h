// Converged ray-cast pictures, cast once and kept.
#pragma once

#include <string>

#include "base/light.h"
#include "bench/fidelity/scenes.h"
#include "splat/raycast.h"

namespace freevoxel::bench {

/// The picture of `raycast` for this scene, camera and options, from the cache if it is there.
Image reference(const Scene& scene, const Camera& camera, const RaycastOptions& options, const Folders& folders);

}  // namespace freevoxel::bench
