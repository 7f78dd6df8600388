// The plain C++ tracer over the VoxLink buffers: the CPU backend, and the oracle of the one on the GPU.
#pragma once

#include <cstdint>
#include <span>

#include "base/camera.h"
#include "base/image.h"
#include "base/progress.h"
#include "voxlink/buffers.h"
#include "voxlink/image_rows.h"

namespace freevoxel {

/// Premultiplied linear RGBA of the rows. Every voxel is a box of its own colour and extinction, met exactly (what ray
/// casting with nearest neighbours tends to with small steps). `light` is lightVoxels, or empty: voxels shine with
/// their own colour. Same bytes for any thread count.
Image traceRays(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                std::span<const uint32_t> light, const Camera& camera, ImageRows rows, Progress& progress);

}  // namespace freevoxel
