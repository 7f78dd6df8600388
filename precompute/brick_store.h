// Where finished bricks go on their way into the file: the part of writing that depends on the layout.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <mutex>
#include <span>
#include <vector>

#include "base/atomic_file.h"
#include "precompute/brick_frames.h"
#include "precompute/format.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

/// Takes every stored brick three times: its codes and the planes of each pass. Bricks count in file order.
class BrickStore {
 public:
  virtual ~BrickStore() = default;

  /// Codes of the bricks first, first + 1, ...: edge^3 of 1 or 2 bytes each along the curve. From many threads. Throws
  /// MachineError.
  virtual void codes(size_t first, std::span<const std::byte> planes) = 0;
  /// The 13 planes of a pass, edge^3 bytes each along the curve. From many threads. Throws MachineError.
  virtual void attenuation(int pass, size_t brick, std::span<const uint8_t> planes) = 0;
  /// All bricks of a slab are there: their codes, or the planes of a pass. From one thread, with the slabs in the same
  /// order whatever the threads and the memory, for each section on its own. Throws MachineError.
  virtual void endSlab() = 0;

  /// The section BRIK, complete once all bricks are.
  std::span<const BrickEntry> entries() const { return entries_; }

 protected:
  explicit BrickStore(std::span<const StoredBrick> bricks);

  std::vector<BrickEntry> entries_;
};

/// Layout dense: every brick has its place from the start.
class DenseStore final : public BrickStore {
 public:
  /// Where the first brick of each section lies in the file.
  struct Offsets {
    uint64_t codes = 0;
    uint64_t backward = 0;
    uint64_t forward = 0;
  };
  /// All arguments must outlive the store.
  DenseStore(AtomicFile& file, const Offsets& offsets, std::span<const StoredBrick> bricks, int edge, int bytesPerCode);

  void codes(size_t first, std::span<const std::byte> planes) override;
  void attenuation(int pass, size_t brick, std::span<const uint8_t> planes) override;
  void endSlab() override {}

 private:
  AtomicFile& file_;
  Offsets offsets_;
  uint64_t codeBytes_, attenuationBytes_;  ///< of a brick in a section
};

/// Layout compact: frames (precompute/brick_frames.h) one after another, slab by slab. How long a section becomes is
/// known only at the end, so each is first written where it has room for the worst.
class CompactStore : public BrickStore {
 public:
  /// A section as it grows.
  struct Section {
    uint64_t offset = 0;  ///< in the file
    uint64_t bytes = 0;   ///< so far
  };
  /// `offsets`: of codes, backward and forward faces, far enough apart: largestFrame() for every brick. All arguments
  /// must outlive the store.
  CompactStore(AtomicFile& file, const std::array<uint64_t, 3>& offsets, std::span<const StoredBrick> bricks,
               glm::ivec3 dims, int edge, int bytesPerCode);

  void codes(size_t first, std::span<const std::byte> planes) override;
  void attenuation(int pass, size_t brick, std::span<const uint8_t> planes) override;
  void endSlab() override;

  /// The section of codes, of backward or of forward faces (0, 1, 2) as it stands in the file now.
  const Section& section(size_t which) const { return sections_[which]; }
  /// Where the frames lie; complete once all bricks are.
  std::span<const FrameEntry> frames() const { return frames_; }

 protected:
  /// Frames that follow each other, `offset` bytes behind the start of section `which`.
  virtual void write(size_t which, uint64_t offset, std::span<const std::byte> frames);

 private:
  AtomicFile& file_;
  std::array<Section, 3> sections_;
  std::vector<std::span<const uint16_t>> steps_;  ///< hilbertSteps of each brick
  int edge_, bytesPerCode_;
  void wait(size_t section, size_t brick, Frame frame);

  /// Packed and not yet written.
  struct Waiting {
    size_t brick;
    Frame frame;
  };

  std::vector<FrameEntry> frames_;
  std::mutex mutex_;
  std::array<std::vector<Waiting>, 3> waiting_;  ///< of each section
};

/// The same with the sections in memory, for those whose place in the file is not known before they are complete.
class KeptCompactStore final : public CompactStore {
 public:
  KeptCompactStore(AtomicFile& file, std::span<const StoredBrick> bricks, glm::ivec3 dims, int edge, int bytesPerCode)
      : CompactStore(file, {}, bricks, dims, edge, bytesPerCode) {}
  std::span<const std::byte> bytes(size_t which) const { return kept_[which]; }

 protected:
  void write(size_t which, uint64_t offset, std::span<const std::byte> frames) override;

 private:
  std::array<std::vector<std::byte>, 3> kept_;
};

}  // namespace freevoxel
