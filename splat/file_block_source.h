// Blocks out of an attenuation file, brick by brick as they are needed: no array of the whole volume.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "hierarchy/absent_bricks.h"
#include "splat/block_source.h"
#include "splat/coarse_volume.h"
#include "splat/held_bricks.h"
#include "splat/stored_attenuation.h"
#include "splat/voxel_lighting.h"
#include "volume/code_visibility.h"

namespace freevoxel {

/// What stored attenuation says of the way to one target.
struct StoredTarget {
  Towards towards;
  StoredLookup lookup = StoredLookup::interpolated;
  const CoarseRatio* ratio = nullptr;  ///< null: as it is stored
  bool nearField = false;              ///< at level 0: what lies right before a voxel is traced (near_field.h)
};

/// What the volume lets through towards a lamp: stored, or swept.
struct LampSource {
  std::optional<StoredTarget> stored;
  const AttenuationGrid* swept = nullptr;  ///< if not `stored`; of the finest level
};

/// The bricks of the largest brick-like neighbourhood that a block needs, and of those around them if voxels are
/// shaded, are held in memory; others as long as there is room.
class FileBlockSource final : public BlockSource {
 public:
  struct View {
    StoredTarget eye;
    const VoxelLighting* lighting = nullptr;  ///< null: unlit
    std::vector<LampSource> lamps;            ///< one per lamp of `lighting`
    bool white = false;                       ///< levels from 1 on are drawn without their colours
    bool cells = true;                        ///< whether cells or kernels are drawn
    // For near fields.
    const ClassificationTable* table = nullptr;
    const CodeVisibility* visibility = nullptr;
  };

  /// All must outlive the source. Begins a frame. `absent`, made when it is first needed, and `bricks`, whose other
  /// frames were of the same `white`: of the same file, for one source at a time. `memoryBytes`: that bricks may take
  /// in memory; what one call of prepare() needs is held in any case.
  FileBlockSource(const AttenuationFile& file, View view, std::optional<AbsentBricks>& absent, HeldBricks& bricks,
                  int edge, uint64_t memoryBytes);

  int edge() const override { return edge_; }
  glm::ivec3 dims(int level) const override { return file_.levelDims(level); }
  void prepare(std::span<const VisibleBlock> blocks) override;
  void gather(const VisibleBlock& block, BlockSamples& samples) const override;
  uint64_t volumeBytes() const override { return mostHeld_; }
  bool lit() const override { return view_.lighting != nullptr; }

  /// Bytes of the bricks that one block needs at most.
  static uint64_t bytesPerBlock(int edge, int brickEdge, const View& view);
  /// Blocks in which a brick of the level is stored, along the Hilbert curve.
  static std::vector<VisibleBlock> storedBlocks(const AttenuationFile& file, int level, int edge);

 private:
  struct Place {
    int level;
    glm::ivec3 position;  ///< origin / brick edge
  };
  /// What is looked up of a level.
  struct Level {
    StoredAttenuation eye;
    std::vector<std::optional<StoredAttenuation>> lamps;
  };

  static uint64_t key(const Place& place);
  const HeldBrick& brick(const Place& place) const;
  std::vector<Place> bricksOf(std::span<const VisibleBlock> blocks) const;
  /// The places, and those of level `most` or finer with all bricks that share a face with them, or, with `corners`, a
  /// corner.
  std::vector<Place> withNeighbours(const std::vector<Place>& places, int most, bool corners) const;
  /// Of levels from 1 on: what is looked at.
  bool cover() const { return view_.cells; }
  bool matter() const { return !view_.cells || (lit() && view_.lighting->shaded()); }
  bool hasValues(const Place& place, const HeldBrick& brick) const;
  /// Codes, or matter and cover.
  void readValues(const Place& place, HeldBrick& brick) const;
  /// Attenuation without the near field, where there is one to come.
  void readFar(const Place& place, HeldBrick& brick) const;
  /// All else; values and far attenuation of the bricks around are there as far as shading and near fields ask for
  /// them.
  void readAttenuation(const Place& place, HeldBrick& brick) const;
  void lightBrick(const Place& place, bool stored, const BrickView* view, HeldBrick& brick) const;
  bool near(int level, const std::optional<StoredTarget>& target) const {
    return level == 0 && target && target->nearField;
  }
  /// Attenuation of a brick of level 0 towards nearTargets_[n].
  void traceNearField(const Place& place, size_t n, std::span<uint16_t> attenuations) const;
  const StoredTarget& target(int lamp) const { return lamp < 0 ? view_.eye : *view_.lamps[size_t(lamp)].stored; }
  const StoredAttenuation& lookup(int level, int lamp) const {
    return lamp < 0 ? levels_[size_t(level)].eye : *levels_[size_t(level)].lamps[size_t(lamp)];
  }
  /// Copies a box of voxels out of the bricks that hold them, x fastest; beyond the volume the outermost voxels.
  /// `voxelsOf`: of a HeldBrick.
  template <class T, class VoxelsOf>
  void copyBox(int level, glm::ivec3 first, glm::ivec3 size, const VoxelsOf& voxelsOf, T* out) const;
  std::vector<glm::vec3> gradients(const Place& place, const HeldBrick& brick) const;
  size_t brickVoxels() const {
    return size_t(file_.brickEdge()) * size_t(file_.brickEdge()) * size_t(file_.brickEdge());
  }

  const AttenuationFile& file_;
  View view_;
  std::optional<AbsentBricks>& absent_;
  HeldBricks& bricks_;
  int edge_;
  uint64_t memoryBytes_;
  std::vector<Level> levels_;
  std::vector<int> nearTargets_;  ///< targets with near fields: -1 for the eye, numbers of lamps
  uint64_t mostHeld_ = 0;         ///< the most that bricks took
};

}  // namespace freevoxel
