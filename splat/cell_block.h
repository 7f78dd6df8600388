// A block as the cell footprint wants it.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "shaders/shared/cell_segment.h"
#include "splat/block_source.h"
#include "splat/volume_view.h"

namespace freevoxel {

using shared::CellLayout;
static_assert(sizeof(CellLayout) == 80 && offsetof(CellLayout, lowA) == 24 && offsetof(CellLayout, lastB) == 48 &&
                  offsetof(CellLayout, lit) == 68 && offsetof(CellLayout, matter) == 76,
              "the shaders read layouts at these offsets");

/// The block as rays with dominant axis `axis` see it. `dims`: of its level. `samples` is 0, and `matter` too from
/// level 1 on, until somebody says better.
CellLayout cellLayout(const VisibleBlock& block, glm::ivec3 dims, int edge, int axis, bool lit);

/// Pixels whose rays may pass the visible part of a block; high is exclusive.
struct PixelBounds {
  glm::ivec2 low{0}, high{0};
  bool empty() const { return low.x >= high.x || low.y >= high.y; }
};

PixelBounds pixelBounds(const VolumeView& view, const VisibleBlock& block);

/// Whether no voxel that the block's rays may touch has attenuation of `threshold` (of AttenuationGrid::kUnit) or more.
/// Never at the volume's border, where a ray sees what it enters first, whatever the voxels around say.
bool isHidden(const VisibleBlock& block, glm::ivec3 dims, int edge, const BlockSamples& samples, uint16_t threshold);

}  // namespace freevoxel
