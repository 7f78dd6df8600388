// Where the voxels of blocks come from: arrays of the whole volume, or bricks of a file as they are needed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "shaders/shared/cell_segment.h"
#include "splat/classification_table.h"
#include "splat/light_grid.h"
#include "splat/visible_blocks.h"

namespace freevoxel {

/// Voxels along an edge of a block's array: one more before the block and two after it.
inline constexpr int blockSide(int edge) {
  return edge + 3;
}
inline constexpr size_t blockVoxels(int edge) {
  return size_t(blockSide(edge)) * size_t(blockSide(edge)) * size_t(blockSide(edge));
}
/// The largest edge that a block can have.
inline constexpr int kLargestBlockEdge = 61;

/// A block's voxels with an apron, clamped at the volume's border: blockVoxels(edge) each, x fastest, from origin - 1
/// on.
struct BlockSamples {
  std::vector<uint16_t> codes;  ///< at level 0, else empty
  // From level 1 on, else empty: for kernels colour times extinction and extinction, for cells what they interpolate.
  std::vector<TableEntry> matter;
  std::vector<shared::CoverValue> cover;
  std::vector<uint16_t> attenuations;  ///< towards the eye, of AttenuationGrid::kUnit
  std::vector<LightValue> lights;      ///< empty: unlit
};

class BlockSource {
 public:
  virtual ~BlockSource() = default;
  /// Of blocks, in voxels of their level.
  virtual int edge() const = 0;
  /// Voxels of a level along each axis.
  virtual glm::ivec3 dims(int level) const = 0;
  /// Makes ready what the blocks need, and may drop what others needed. From one thread. Throws InputError if the file
  /// is damaged.
  virtual void prepare(std::span<const VisibleBlock> blocks) = 0;
  /// Of a block that was among those prepared last. From many threads.
  virtual void gather(const VisibleBlock& block, BlockSamples& samples) const = 0;
  /// Most that values, attenuation and light took in memory at once: of the whole volume, or of the bricks that were
  /// needed.
  virtual uint64_t volumeBytes() const = 0;
  /// Whether voxels have light of their own.
  virtual bool lit() const = 0;
};

}  // namespace freevoxel
