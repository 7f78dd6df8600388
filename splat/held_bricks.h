// Bricks of an attenuation file in memory, from frame to frame: what of them does not depend on the view is read once.
#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "shaders/shared/cell_segment.h"
#include "splat/classification_table.h"
#include "splat/light_grid.h"

namespace freevoxel {

/// A brick's voxels, x fastest; those outside the volume hold anything.
struct HeldBrick {
  std::vector<uint16_t> codes;     ///< of level 0
  std::vector<TableEntry> matter;  ///< of levels from 1 on, if it is looked at: colour times extinction, extinction
  std::vector<shared::CoverValue> cover;  ///< the same
  /// Attenuation without near fields, of the frame `farIn`: towards each target that has one.
  std::vector<std::vector<uint16_t>> far;
  uint64_t farIn = 0;
  std::vector<uint16_t> attenuations;  ///< towards the eye, of AttenuationGrid::kUnit, of the frame `viewedIn`
  std::vector<LightValue> lights;      ///< of the same frame; empty: unlit
  uint64_t viewedIn = 0;
  uint64_t lastUsed = 0;  ///< call of HeldBricks::nextCall

  uint64_t bytes() const;
};

/// By a number that its user makes of level and position.
class HeldBricks {
 public:
  /// What views left in bricks counts no more; its memory stays for the next.
  void beginFrame() { ++frame_; }
  uint64_t frame() const { return frame_; }

  /// Bricks used from now on are younger than all others.
  void nextCall() { ++call_; }
  /// Empty if it was not there.
  HeldBrick& use(uint64_t number);
  /// Null if it is not there.
  const HeldBrick* find(uint64_t number) const;

  uint64_t bytes() const { return bytes_; }
  /// Tells how much more or less a brick takes than before.
  void grow(uint64_t before, uint64_t now) { bytes_ += now - before; }
  /// Forgets bricks not used in this call, those first that were not used for the longest time, down to so many bytes.
  void forget(uint64_t bytes);
  void clear();

 private:
  std::unordered_map<uint64_t, HeldBrick> bricks_;
  uint64_t bytes_ = 0, frame_ = 0, call_ = 0;
};

}  // namespace freevoxel
