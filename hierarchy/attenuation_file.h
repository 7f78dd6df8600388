// The mapped reader of attenuation files.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/mapped_file.h"
#include "base/placement.h"
#include "hierarchy/brick_regeneration.h"
#include "hierarchy/pinned_planes.h"
#include "precompute/format.h"
#include "precompute/hilbert.h"
#include "volume/transfer_function.h"
#include "volume/value_codes.h"

namespace freevoxel {

/// One stored brick, valid as long as the AttenuationFile: views into the map (layout dense) or
/// into memory of its own (compact). Move-only. Planes hold edge^3 entries in curve order (see `curve`). Voxels of the
/// brick that lie outside the volume have code 0 and attenuation 255 and must be skipped: origin + curve[i] >= dims.
struct BrickView {
  uint64_t hilbertIndex = 0;  ///< of the brick among bricks
  glm::ivec3 origin{0};       ///< its first voxel, of its level
  int edge = 16;              ///< voxels
  int level = 0;
  uint32_t visibleVoxels = 0;
  std::span<const LocalPosition> curve;  ///< step along the curve -> place in the brick
  std::span<const uint16_t> steps;       ///< local linear index (x fastest) -> step along the curve
  int bytesPerCode = 1;
  const std::byte* codes = nullptr;  ///< value codes, 1 or 2 bytes each, little-endian; null from level 1 on
  /// From level 1 on: linear red, green and blue, 65535 for 1, and extinction as IEEE binary16, in log2 per shortest
  /// edge of the finest level; else null.
  const uint16_t* matter[kMatterPlanes] = {};
  /// Per direction index: round(255 * A), in layout compact off by one at most; null unless asked for.
  const uint8_t* attenuations[26] = {};
  std::unique_ptr<std::byte[]> unpacked;  ///< what the above point into, if not the map

  uint32_t code(size_t step) const {
    return bytesPerCode == 1 ? uint32_t(codes[step]) : uint32_t(codes[2 * step]) | uint32_t(codes[2 * step + 1]) << 8;
  }
};

/// An attenuation file opened for reading. Everything but the payload is checked on open: every offset, size and count
/// is known to lie inside the file before it is used. A file that is cut meanwhile reads as zeros there: see
/// checkIntact(). Move-only; const members may be called from many threads.
class AttenuationFile {
 public:
  /// Throws InputError naming file, offset, what was expected and what was found.
  explicit AttenuationFile(const std::string& path);

  const std::string& path() const { return path_; }
  glm::ivec3 dims() const { return {metadata_.dims[0], metadata_.dims[1], metadata_.dims[2]}; }
  const Placement& placement() const { return placement_; }
  const ValueCoding& coding() const { return coding_; }
  const TransferFunction& transfer() const { return transfer_; }  ///< the one it was made with
  Classification classification() const { return metadata_.classification; }
  Layout layout() const { return metadata_.layout; }
  int levels() const { return int(metadata_.levels); }
  Hierarchy hierarchy() const { return metadata_.hierarchy; }  ///< of levels from 1 on
  int brickEdge() const { return int(metadata_.brickEdge); }
  uint64_t fileBytes() const { return map_.bytes().size(); }
  uint64_t storedVoxels() const { return metadata_.storedVoxels; }          ///< of the volume, in stored bricks
  uint64_t visibleVoxels() const { return metadata_.visibleVoxels; }        ///< opacity > 0
  uint64_t nonFinite() const { return metadata_.nonFinite; }                ///< voxels that were NaN or infinite
  double largestValueError() const { return metadata_.largestValueError; }  ///< by coding values, data units
  uint64_t codeBytes() const;                  ///< that values take in the file, the directories left out
  uint64_t attenuationBytes() const;           ///< that attenuation takes, as above
  uint64_t identity() const { return hash_; }  ///< a hash of the whole file, as its header has it
  std::string command() const;                 ///< that made the file; empty if not recorded

  /// What attenuation was swept towards when the file was made.
  const PinnedPlanes& pinned() const { return pinned_; }

  size_t brickCount() const { return bricks_.size(); }  ///< stored bricks, sorted along the Hilbert curve
  glm::ivec3 brickOrigin(size_t i) const;               ///< its first voxel
  uint32_t visibleVoxelsOf(size_t i) const { return bricks_[i].visibleVoxels; }  ///< of brick i
  /// Codes and the attenuation along `directions`. Layout compact unpacks them here, at a cost for every direction.
  /// Throws InputError if that brick is damaged, which layout dense does not notice.
  BrickView brick(size_t i, DirectionSet directions = kAllDirections) const;
  /// Position in brick() order of the brick at `brickPosition` (voxel / brickEdge), or nothing if it is not stored (or
  /// lies outside the volume).
  std::optional<size_t> findBrick(glm::ivec3 brickPosition) const;

  /// The same of any level, 0 <= level < levels(): voxels, stored bricks, their first voxels.
  glm::ivec3 levelDims(int level) const;
  size_t levelBrickCount(int level) const;
  glm::ivec3 levelBrickOrigin(int level, size_t i) const;
  /// From level 1 on without its matter, unless `matter`.
  BrickView levelBrick(int level, size_t i, DirectionSet directions = kAllDirections, bool matter = true) const;
  std::optional<size_t> findLevelBrick(int level, glm::ivec3 brickPosition) const;
  uint64_t levelBytes() const;  ///< that levels from 1 on take in the file, the directory left out

  /// Tells the system that a brick will be read soon.
  void prefetch(int level, size_t i) const;

  /// Throws InputError if the file was cut or could not be read since it was opened. Whoever has used bricks calls it
  /// before he relies on them.
  void checkIntact() const { map_.checkIntact(); }
  /// Checks every checksum and every padding byte. Throws InputError naming the first damaged section and its offset.
  void verify() const;
  /// Checks one brick against its own checksums, which were checked on open. Throws InputError naming its offset.
  void verifyBrick(size_t i) const;

 private:
  std::span<const std::byte> content(const SectionEntry& entry) const;
  const SectionEntry* find(SectionType type) const;
  const SectionEntry& required(SectionType type) const;

  void readHeader();
  void readSectionTable(const FileHeader& header);
  void readMetadata();
  void readTransfer();
  void readDirections();
  void readBricks();
  void readPins();
  void verifyHash(const SectionEntry& entry, uint64_t hash) const;
  void verifySection(const SectionEntry& entry) const;
  void readFrames();
  /// Throws InputError naming the frame unless the frames of a section fill it.
  void checkFrames(size_t which) const;
  void checkBrickSection(SectionType type, uint64_t bytesPerBrick) const;
  void readLevels();
  void readLevelEntries(const SectionEntry& section);
  /// Bytes of entry `entry` of LEVL in section `which` of LMAT, LATB and LATF.
  std::span<const std::byte> storedLevel(size_t which, const LevelEntry& entry) const;
  void verifyLevels() const;
  void verifyLevelEntry(size_t entry) const;

  /// The sections of codes, of directions 0..12 and of 13..25.
  std::array<SectionType, 3> brickSections() const;
  /// What section `which` of brickSections() holds of brick i.
  std::span<const std::byte> stored(size_t which, size_t i) const;
  uint64_t storedOffset(size_t which, size_t i) const;  ///< of the same, in the section
  void viewMap(BrickView& view, size_t i) const;
  void unpack(BrickView& view, size_t i, DirectionSet directions) const;

  uint64_t brickVoxels() const;
  uint64_t denseBytes(size_t which) const {  ///< of a brick in section `which` of layout dense
    return brickVoxels() * (which == 0 ? metadata_.codeBytes : uint64_t(kDirectionsPerSection));
  }

  std::string path_;
  MappedFile map_;
  std::vector<SectionEntry> sections_;
  Metadata metadata_{};
  Placement placement_;
  ValueCoding coding_;
  TransferFunction transfer_;
  uint64_t hash_ = 0;
  int curveOrder_ = 0;  ///< of the curve through the bricks
  // Copies: what has been checked must not change with the file.
  std::vector<BrickEntry> bricks_;
  std::vector<FrameEntry> frames_;  ///< of layout compact
  std::array<std::span<const std::byte>, 3> brickData_;
  std::vector<LevelEntry> levelEntries_;  ///< of levels from 1 on
  std::vector<size_t> levelStarts_;       ///< by level, where its entries start, and their end; [0] unused
  std::array<std::span<const std::byte>, 3> levelData_;
  std::unique_ptr<const BrickRegeneration> regeneration_;  ///< of layout compact
  PinnedPlanes pinned_;
};

}  // namespace freevoxel
