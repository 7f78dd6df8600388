// Blocks out of an attenuation file, brick by brick as they are needed: no array of the whole volume.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "hierarchy/absent_bricks.h"
#include "splat/block_source.h"
#include "splat/coarse_volume.h"
#include "splat/stored_attenuation.h"
#include "splat/voxel_lighting.h"

namespace freevoxel {

/// What stored attenuation says of the way to one target.
struct StoredTarget {
  Towards towards;
  StoredLookup lookup = StoredLookup::interpolated;
  const CoarseRatio* ratio = nullptr;  ///< null: as it is stored
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
  };

  /// All must outlive the source. `absent`: of the same file, made when it is first needed. `memoryBytes`: that bricks
  /// may take in memory; what one call of prepare() needs is held in any case.
  FileBlockSource(const AttenuationFile& file, View view, std::optional<AbsentBricks>& absent, int edge,
                  uint64_t memoryBytes);

  int edge() const override { return edge_; }
  glm::ivec3 dims(int level) const override { return file_.levelDims(level); }
  void prepare(std::span<const VisibleBlock> blocks) override;
  void gather(const VisibleBlock& block, BlockSamples& samples) const override;
  uint64_t volumeBytes() const override { return mostHeld_; }
  bool lit() const override { return view_.lighting != nullptr; }

  /// Bytes of the bricks that one block needs at most.
  static uint64_t bytesPerBlock(int edge, int brickEdge, bool lit, bool shaded);
  /// Blocks in which a brick of the level is stored, along the Hilbert curve.
  static std::vector<VisibleBlock> storedBlocks(const AttenuationFile& file, int level, int edge);

 private:
  /// A brick's voxels, x fastest; those outside the volume hold anything.
  struct Brick {
    std::vector<uint16_t> codes;
    std::vector<TableEntry> matter;
    std::vector<uint16_t> attenuations;
    std::vector<LightValue> lights;
    uint64_t lastUsed = 0;
    bool complete() const { return !attenuations.empty(); }
    uint64_t bytes() const {
      return codes.size() * sizeof(codes[0]) + matter.size() * sizeof(matter[0]) +
             attenuations.size() * sizeof(attenuations[0]) + lights.size() * sizeof(lights[0]);
    }
  };
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
  const Brick& brick(const Place& place) const;
  std::vector<Place> bricksOf(std::span<const VisibleBlock> blocks) const;
  std::vector<Place> withNeighbours(const std::vector<Place>& places) const;
  /// Codes or matter.
  void readValues(const Place& place, Brick& brick) const;
  /// All else; the values of the brick and, if shaded, of the six around it are there.
  void readAttenuation(const Place& place, Brick& brick) const;
  void lightBrick(const Place& place, const BrickView* view, Brick& brick) const;
  std::vector<glm::vec3> gradients(const Place& place, const Brick& brick) const;
  void forget();
  size_t brickVoxels() const {
    return size_t(file_.brickEdge()) * size_t(file_.brickEdge()) * size_t(file_.brickEdge());
  }

  const AttenuationFile& file_;
  View view_;
  std::optional<AbsentBricks>& absent_;
  int edge_;
  uint64_t memoryBytes_;
  std::vector<Level> levels_;
  std::unordered_map<uint64_t, Brick> bricks_;
  uint64_t held_ = 0;      ///< bytes of bricks_
  uint64_t mostHeld_ = 0;  ///< the most that was
  uint64_t call_ = 0;      ///< of prepare()
};

}  // namespace freevoxel
