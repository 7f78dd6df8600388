// The reference: a plain ray caster over the same values, the referee for every picture (DESIGN section 3).
#pragma once

#include <span>
#include <vector>

#include "base/camera.h"
#include "base/image.h"
#include "base/light.h"
#include "base/progress.h"
#include "hierarchy/value_grid.h"
#include "splat/attenuation_grid.h"
#include "volume/transfer_function.h"

namespace freevoxel {

enum class RaycastClassification {
  post,  ///< values interpolated trilinearly, then classified
  pre,   ///< voxels classified, then extinction and extinction-weighted colour interpolated trilinearly; the volume's
         ///< outermost voxels fade out over one voxel
  nearest,  ///< the voxel whose box holds the point
};

struct RaycastOptions {
  RaycastClassification classification = RaycastClassification::post;
  double step = 0.125;       ///< in shortest voxel edges; > 0
  double shadowStep = 0.25;  ///< the same along rays towards lamps
  Lighting lighting;         ///< each sample marches its own rays towards the lamps
};

/// Premultiplied linear RGBA without background. Emission and absorption, emitted light = colour * extinction; samples
/// at the middle of equal steps along the part of the ray inside the box, which reaches half a voxel beyond the
/// outermost samples (values there are those of the nearest sample). Same bytes for any thread count. Throws InputError
/// for steps and lighting that make no sense.
Image raycast(const ValueGrid& grid, const TransferFunction& transfer, const Camera& camera,
              const RaycastOptions& options, Progress& progress);

/// Share of light, 0..1, that gets from positions in index space to a target, marched through post-classified samples:
/// the referee for AttenuationGrid. `step` in shortest voxel edges.
std::vector<float> marchTransmittance(const ValueGrid& grid, const TransferFunction& transfer,
                                      std::span<const glm::dvec3> positions, const Towards& target, double step);

}  // namespace freevoxel
