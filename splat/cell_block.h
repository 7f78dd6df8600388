// A block's voxels with an apron, as the cell footprint wants them.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "hierarchy/value_grid.h"
#include "shaders/shared/cell_segment.h"
#include "splat/attenuation_grid.h"
#include "splat/light_grid.h"
#include "splat/visible_blocks.h"
#include "splat/volume_view.h"

namespace freevoxel {

using shared::CellLayout;
static_assert(sizeof(CellLayout) == 64 && offsetof(CellLayout, firstA) == 24 && offsetof(CellLayout, ownLowB) == 40 &&
                  offsetof(CellLayout, lit) == 56,
              "the shaders read layouts at these offsets");

/// Voxels along an edge of a block's array: one more before the block and two after it.
inline constexpr int blockSide(int edge) {
  return edge + 3;
}
inline constexpr size_t blockVoxels(int edge) {
  return size_t(blockSide(edge)) * size_t(blockSide(edge)) * size_t(blockSide(edge));
}

/// Codes, and attenuation towards the eye, of the block's voxels and apron, clamped at the volume's border: x fastest,
/// blockVoxels(edge) each.
void gatherBlock(const ValueGrid& grid, const AttenuationGrid& attenuation, glm::ivec3 origin, int edge,
                 std::span<uint16_t> codes, std::span<uint16_t> attenuations);
/// The light at the same voxels.
void gatherLight(const LightGrid& light, glm::ivec3 dims, glm::ivec3 origin, int edge, std::span<LightValue> lights);

/// The block as rays with dominant axis `axis` see it.
CellLayout cellLayout(const VisibleBlock& block, glm::ivec3 dims, int edge, int axis, bool lit);

/// Pixels whose rays may pass the visible part of a block; high is exclusive.
struct PixelBounds {
  glm::ivec2 low{0}, high{0};
  bool empty() const { return low.x >= high.x || low.y >= high.y; }
};

PixelBounds pixelBounds(const VolumeView& view, const VisibleBlock& block);

}  // namespace freevoxel
