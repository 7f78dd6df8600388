// Brick data on their way into the file: permuted to curve order and handed to the layout's store, a slab of bricks at
// a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "precompute/brick_store.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// Gives a store codes and attenuation, every brick once. Holds the attenuation of two slabs of bricks, 26 bytes per
/// voxel, so that the 13 planes of a brick go to the store in one piece.
class BrickWriter final : public AttenuationSink {
 public:
  /// `bricks` in file order. `advanced`, from many threads at once, is told of every slab and direction how many voxels
  /// it has. All arguments must outlive the writer.
  BrickWriter(BrickStore& store, std::span<const StoredBrick> bricks, glm::ivec3 dims, int edge,
              std::function<void(uint64_t)> advanced);

  /// The codes of all bricks, slab by slab. Throws MachineError.
  void writeCodes(std::span<const uint16_t> codes, const ValueCoding& coding);

  void receive(const AttenuationSlab& slab) override;
  /// Throws MachineError.
  void complete(int pass, int firstPlane) override;

  /// Spent packing and writing attenuation, by the clock.
  double writeSeconds() const { return writeSeconds_; }

 private:
  uint64_t brickVoxels() const { return uint64_t(edge_) * uint64_t(edge_) * uint64_t(edge_); }
  const std::vector<size_t>& bricksAt(int firstPlane) const { return slabs_[size_t(firstPlane / edge_)]; }
  template <class Code>
  void writeCodesAs(std::span<const uint16_t> codes);

  BrickStore& store_;
  std::span<const StoredBrick> bricks_;
  glm::ivec3 dims_;
  int edge_;
  std::function<void(uint64_t)> advanced_;
  std::vector<std::span<const uint16_t>> steps_;           ///< hilbertSteps of each brick
  std::vector<std::vector<size_t>> slabs_;                 ///< bricks by their z, in file order
  std::array<std::vector<uint8_t>, kSweepPasses> planes_;  ///< of one slab of bricks: 13 planes each
  double writeSeconds_ = 0.0;
};

}  // namespace freevoxel
