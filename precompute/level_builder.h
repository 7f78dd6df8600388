// Levels from 1 on of an attenuation file, while the finest is made (papers/freevoxels section 4.4, Eq. 7).
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "base/atomic_file.h"
#include "precompute/brick_frames.h"
#include "precompute/finest_matter.h"
#include "precompute/format.h"
#include "precompute/level_matter.h"
#include "precompute/level_tap.h"
#include "precompute/stored_bricks.h"
#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// Takes codes and depths of the finest level, slab of bricks by slab, and writes the bricks of all others. Holds, of
/// every level, the bricks of one layer for each pass under way: levelBytes().
class LevelBuilder {
 public:
  struct Shape {
    glm::ivec3 dims{0};
    glm::vec3 edges{1.0f};  ///< of a voxel, in shortest ones
    int brickEdge = 16;
    int levels = 1;
    Hierarchy hierarchy = Hierarchy::geometric;
  };

  /// `offsets`: where in the file the sections of matter, backward and forward attenuation start, far enough apart.
  /// `bricks`: stored, of the finest level, along the curve. All references must outlive the builder.
  LevelBuilder(AtomicFile& file, const std::array<uint64_t, 3>& offsets, const Shape& shape,
               std::span<const StoredBrick> bricks, const TransferFunction& transfer, const ValueCoding& coding);

  /// Codes of the planes of one slab and of those beside it (planesOfSlab); slabs ascend. Throws MachineError.
  void addCodes(int slab, std::span<const uint16_t> codes);
  /// Where a sweep is to put level 1 of a slab.
  LevelTarget target(int pass);
  /// It is there. `codes` as of addCodes; only `weighted` looks at them. Slabs come in the order of the pass. Throws
  /// MachineError.
  void addDepths(int pass, int slab, std::span<const uint16_t> codes);

  bool weighted() const { return shape_.hierarchy == Hierarchy::weighted; }
  /// Complete once everything is added.
  std::span<const LevelEntry> entries() const { return entries_; }
  uint64_t sectionBytes(size_t which) const { return sections_[which].bytes; }

  /// Bricks of all levels from 1 on.
  static uint64_t brickCount(std::span<const StoredBrick> bricks, int levels);
  /// Largest sections, of matter and of attenuation.
  static uint64_t largestMatter(uint64_t bricks, int edge);
  static uint64_t largestAttenuation(uint64_t bricks, int edge);
  /// What building takes in memory.
  static uint64_t memoryBytes(const Shape& shape, int passes);

 private:
  struct Brick {
    glm::ivec3 position{0};
    size_t entry = 0;
    std::span<const uint16_t> steps;  ///< hilbertSteps
  };
  /// Planes of one kind of all bricks of a layer: entries of 1 byte (attenuation) or 2 (matter).
  struct Layer {
    std::vector<std::vector<std::byte>> planes;  ///< of each brick of the layer; empty until it begins
    int filled = 0;                              ///< planes of voxels that are there
  };
  struct Level {
    glm::ivec3 dims{0};
    std::vector<std::vector<Brick>> layers;  ///< by z
    std::array<Layer, 3> open;               ///< the layer under way, of matter and of each pass
  };
  /// Planes of voxels of one level, x fastest.
  template <class T>
  struct Planes {
    glm::ivec3 dims{0};
    std::vector<T> voxels;
  };
  using MatterPlanes = Planes<LevelMatter>;

  int topInSlab() const;  ///< the coarsest level of which a slab has whole planes
  /// Level 1 of a slab. `codes` as of addCodes.
  MatterPlanes matterOfCodes(int slab, std::span<const uint16_t> codes) const;
  MatterPlanes coarser(const MatterPlanes& finer, int level) const;
  std::vector<LevelDepth> coarser(const std::vector<LevelDepth>& finer, glm::ivec3 dims,
                                  const std::vector<float>& weights, glm::ivec3 coarseDims) const;
  std::vector<float> weightsOf(const MatterPlanes& matter, int level) const;
  void storeMatter(int level, int firstPlane, const MatterPlanes& matter);
  void storeDepths(int pass, int level, int firstPlane, glm::ivec3 dims, const std::vector<LevelDepth>& depths);
  /// Writes what `fill(brick, buffer, plane, local z)` gives of planes firstPlane.. of a level, a layer when it is
  /// whole.
  template <class Fill>
  void store(size_t which, int level, int firstPlane, int planes, size_t brickBytes, std::byte outside, Fill&& fill);
  void writeLayer(size_t which, const std::vector<Brick>& bricks, Layer& layer);

  AtomicFile& file_;
  Shape shape_;
  FinestMatter finest_;
  std::vector<float> weights_;  ///< opacity of one edge, by code
  std::vector<Level> levels_;   ///< [0] unused
  std::vector<LevelEntry> entries_;
  struct Section {
    uint64_t offset = 0, bytes = 0;
  };
  std::array<Section, 3> sections_;
  std::array<std::vector<LevelDepth>, 2> tapped_;  ///< level 1 of a slab, of each pass
  // Of level topInSlab(), whole: what coarser levels are made of.
  MatterPlanes topMatter_;
  std::array<std::vector<LevelDepth>, 2> topDepths_;
  std::vector<float> topWeights_;
};

}  // namespace freevoxel
