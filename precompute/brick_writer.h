// Brick data on their way into the file: codes permuted to curve order, all handed to the layout's store, a slab of
// bricks at a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "precompute/brick_store.h"
#include "precompute/format.h"
#include "precompute/level_builder.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// Gives a store codes and attenuation, every brick once. Holds the attenuation of a slab of bricks for each pass under
/// way, 13 bytes per voxel, so that the 13 planes of a brick go to the store in one piece.
class BrickWriter final : public AttenuationSink {
 public:
  /// `bricks` in file order. `advanced` is told of every slab and pass how many voxels, once for each direction, are
  /// done. All arguments must outlive the writer.
  BrickWriter(BrickStore& store, std::span<const StoredBrick> bricks, glm::ivec3 dims, int edge,
              std::function<void(uint64_t)> advanced);

  /// The codes of one slab of bricks: `codes` are those of its planes. Throws MachineError.
  void writeCodes(int slab, std::span<const uint16_t> codes, const ValueCoding& coding);

  std::span<const BrickPlanes> begin(int pass, int slab) override;
  /// Gives level 1 on to `levels`, which must outlive the writer; `codes`: what is swept.
  void buildLevels(LevelBuilder& levels, CodePlanes& codes) {
    levels_ = &levels;
    codes_ = &codes;
  }
  LevelTarget levels(int pass, int slab) override;
  /// Throws MachineError.
  void complete(int pass, int slab) override;

  /// Bytes of the planes of one pass.
  uint64_t passBytes() const { return largestSlab_ * kDirectionsPerSection * brickVoxels(); }
  /// Spent packing and writing attenuation, by the clock.
  double writeSeconds() const { return writeSeconds_; }

 private:
  uint64_t brickVoxels() const { return uint64_t(edge_) * uint64_t(edge_) * uint64_t(edge_); }
  template <class Code>
  void writeCodesAs(int slab, std::span<const uint16_t> codes);

  BrickStore& store_;
  std::span<const StoredBrick> bricks_;
  glm::ivec3 dims_;
  int edge_;
  std::function<void(uint64_t)> advanced_;
  std::vector<std::span<const uint16_t>> steps_;  ///< hilbertSteps of each brick
  std::vector<int> states_;                       ///< hilbertState of each brick
  std::vector<std::vector<size_t>> slabs_;        ///< bricks by their z, in file order
  size_t largestSlab_ = 0;                        ///< bricks
  /// Of one slab of bricks: 13 planes each.
  struct alignas(kBrickPlaneAlignment) Line {
    uint8_t bytes[kBrickPlaneAlignment];
  };
  std::array<std::vector<Line>, kSweepPasses> planes_;
  std::array<std::vector<BrickPlanes>, kSweepPasses> wanted_;
  double writeSeconds_ = 0.0;
  LevelBuilder* levels_ = nullptr;
  CodePlanes* codes_ = nullptr;
};

}  // namespace freevoxel
