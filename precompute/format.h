// The attenuation file, .fvx, byte by byte. docs/format.md says the same in more words.
//
// All numbers are little-endian; "f64" is IEEE binary64; every byte not drawn here is zero.
//
//   offset  bytes  file
//        0     32  FileHeader
//             0      8  magic 89 'F' 'V' 'X' 0D 0A 1A 0A
//             8      4  version, 1
//            12      4  number of sections, n
//            16      8  bytes of the whole file
//            24      8  XXH3-64 of bytes 0..23 and of the section table
//       32  40 n  section table, one SectionEntry per section, ascending offsets
//             0      4  type, four ASCII characters
//             4      4  flags; bit 0: a reader that does not know the type may skip the section
//             8      8  offset, a multiple of 8, and of 4096 for CODE, ATTB and ATTF
//            16      8  bytes
//            24      8  number of items
//            32      8  XXH3-64 of the section's bytes; of those that hold bricks (CODE, ATTB, ATTF, ZCOD, ZFCB, ZFCF):
//                       of their hashes in BRIK, brick by brick; of LMAT, LATB and LATF of those in LEVL
//             sections, none overlapping another, zeros between them; the file ends where the last one ends
//
//   type  items  what an item is
//   META      1  Metadata, 240 bytes
//             0     12  dims x y z, i32 each
//            12      4  brick edge E in voxels: 8, 16 or 32
//            16     24  spacing x y z, f64, in the volume's length unit
//            40     24  origin x y z, f64: centre of voxel (0,0,0)
//            64     72  direction, 9 f64, column by column: unit vectors of the index axes in world space
//           136      8  length unit, ASCII, zero padded; all zero: not known
//           144      8  value of code 0, f64
//           152      8  value step from code to code, f64
//           160      4  largest code, 1..65535
//           164      4  bytes per code, b: 1 if the largest code is <= 255, else 2
//           168      4  classification: 0 voxel, 1 preintegrated
//           172      4  layout: 0 dense, 1 compact
//           176      4  levels, the finest included: 1, or up to as many as it takes until one brick holds the volume
//           180      4  hierarchy: how attenuation of levels from 1 on is made, 0 geometric, 1 weighted; 0 if levels is
//           1 184      8  voxels of the volume, dims x * y * z 192      8  voxels of the volume that lie in stored
//           bricks 200      8  visible voxels: opacity > 0 208      8  voxels that were NaN or infinite 216      8 hash
//           of all that attenuation depends on in the transfer function (opacityHash) 224      8  largest error of a
//           value inside the range by coding it, f64 232      8  zero
//   XFER  bytes  transfer function, JSON text (UTF-8)
//   DIRS     26  direction: x y z, i8 each, pointing from the voxel outwards, in the order of direction indices
//   BRIK  bricks stored brick, BrickEntry, ascending Hilbert index
//             0      8  Hilbert index of the brick, position (voxel / E), in the smallest cube of 2^k bricks an edge
//                       that holds the volume
//             8      4  visible voxels in it
//            12      4  zero
//            16     24  XXH3-64 of the brick's bytes in CODE, in ATTB and in ATTF; in ZCOD, in ZFCB and in ZFCF
//   CMND  bytes  the command that made the file, UTF-8 text; may be skipped
//   PINS   pins  what attenuation is pinned towards, PinEntry (pins.h); may be skipped with PFRM and ZPIN
//             0      4  kind: 0 a direction, 1 a position
//             4      4  zero
//             8     24  x y z in world space, f64; a direction of any length but 0
//   PFRM     p b  where the frames of the p pins lie, PinFrameEntry: pin by pin, for each of the b bricks of the
//                 volume, stored or not, x fastest
//             0      4  bytes in ZPIN; 0: attenuation is the same all over the brick
//             4      4  then that attenuation; else zero
//   ZPIN   pins  frames (brick_frames.h) of round(65535 A) along the curve, as codes of two bytes, in the order of PFRM
//                without gap; 65535 outside the volume
//
// Layout dense has
//   CODE  bricks value codes: E^3 of b bytes each along the Hilbert curve; 0 outside the volume
//   ATTB  bricks 13 planes of E^3 bytes, directions 0..12: round(255 A) along the curve; 255 outside the volume
//   ATTF  bricks 13 planes of E^3 bytes, directions 13..25
// and layout compact
//   FRAM  bricks where the frames of a brick lie, FrameEntry, in the order of BRIK
//             0     24  offset in ZCOD, in ZFCB and in ZFCF, u64 each
//            24     12  bytes in ZCOD, in ZFCB and in ZFCF, u32 each
//            36      4  zero
//   ZCOD  bricks frames (brick_frames.h) of value codes, as in CODE
//   ZFCB  bricks frames of faces, directions 0..12: of ATTB the voxels from which one step leaves the brick
//   ZFCF  bricks frames of faces, directions 13..25
//
// If there is more than one level, both layouts have
//   LEVL  bricks brick of a level from 1 on, LevelEntry, ascending level, then ascending Hilbert index
//             0      4  level
//             4      4  zero
//             8      8  Hilbert index of the brick among those of its level, as in BRIK
//            16     24  offset in LMAT, in LATB and in LATF, u64 each
//            40     12  bytes in LMAT, in LATB and in LATF, u32 each
//            52      4  zero
//            56     24  XXH3-64 of the brick's bytes in LMAT, in LATB and in LATF
//   LMAT  bricks frames (brick_frames.h, of codes of 2 bytes): 4 planes of E^3 along the curve, red, green, blue
//   (linear,
//                65535 is 1) and extinction (IEEE binary16, log2 per shortest edge of the finest level); 0 outside
//   LATB  bricks frames (of codes of 1 byte): 13 planes as in ATTB, of the level's voxels; 255 outside the volume
//   LATF  bricks frames, directions 13..25
// A voxel of level k stands for 2^k x 2^k x 2^k voxels of the finest, those of them that lie inside the volume. A brick
// is stored if one of the eight that it stands for is; its curve is the same, one order lower.
//
// Bricks stand in CODE, ATTB and ATTF in the order of BRIK, so any one is found by multiplication. Frames fill ZCOD,
// ZFCB and ZFCF without gap or overlap, in any order. Any brick is checked without reading the others: the header's
// hash covers that of BRIK, which covers those of the bricks. A brick is stored if one of its voxels is a corner of a
// visible cell.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "shaders/shared/directions.h"

namespace freevoxel {

static_assert(std::endian::native == std::endian::little, "the file is mapped and used as it is");

/// How A8 is made of values: the paper's Eq. 5, product of the transmittances of the voxels strictly between a voxel
/// and the outside; or Eq. 4, every segment between two voxels classified after interpolation between their values.
enum class Classification : uint32_t { voxel = 0, preintegrated = 1 };

/// dense: 26 bytes per stored voxel, the paper's section 5. compact: only the faces where rays enter bricks.
enum class Layout : uint32_t { dense = 0, compact = 1 };

/// How A of a voxel of a coarser level is made of those that it stands for: their geometric mean (papers/freevoxels
/// Eq. 7), or their mean weighted by opacity (geometric where nothing is visible).
enum class Hierarchy : uint32_t { geometric = 0, weighted = 1 };

/// Names on the command line.
constexpr std::string_view hierarchyName(Hierarchy hierarchy) {
  return hierarchy == Hierarchy::geometric ? "geometric" : "weighted";
}
constexpr std::string_view classificationName(Classification classification) {
  return classification == Classification::voxel ? "voxel" : "preintegrated";
}
constexpr std::string_view layoutName(Layout layout) {
  return layout == Layout::dense ? "dense" : "compact";
}
constexpr std::optional<Classification> classificationFromName(std::string_view name) {
  if (name == "voxel") return Classification::voxel;
  if (name == "preintegrated") return Classification::preintegrated;
  return std::nullopt;
}
constexpr std::optional<Layout> layoutFromName(std::string_view name) {
  if (name == "dense") return Layout::dense;
  if (name == "compact") return Layout::compact;
  return std::nullopt;
}

/// Like PNG's: a byte over 127, a name, and line ends and control-Z that text transfers would damage.
inline constexpr std::array<uint8_t, 8> kFileMagic = {0x89, 'F', 'V', 'X', 0x0d, 0x0a, 0x1a, 0x0a};
inline constexpr uint32_t kFileVersion = 1;

inline constexpr uint64_t kSectionAlignment = 8;
/// Brick data start on a page so that they can be mapped, or read past the page cache.
inline constexpr uint64_t kPageBytes = 4096;
/// Far more than there will be types; bounds what is read on the word of a damaged header.
inline constexpr uint32_t kLargestSectionCount = 1024;

inline constexpr int kDirectionsPerSection = shared::kDirectionCount / 2;
inline constexpr uint8_t kAttenuationOutside = 255;

/// Four characters in reading order, as they stand in the file.
using SectionType = std::array<char, 4>;
namespace section {
inline constexpr SectionType kMetadata = {'M', 'E', 'T', 'A'};
inline constexpr SectionType kTransfer = {'X', 'F', 'E', 'R'};
inline constexpr SectionType kDirections = {'D', 'I', 'R', 'S'};
inline constexpr SectionType kBricks = {'B', 'R', 'I', 'K'};
inline constexpr SectionType kCodes = {'C', 'O', 'D', 'E'};
inline constexpr SectionType kBackward = {'A', 'T', 'T', 'B'};
inline constexpr SectionType kForward = {'A', 'T', 'T', 'F'};
inline constexpr SectionType kFrames = {'F', 'R', 'A', 'M'};
inline constexpr SectionType kPackedCodes = {'Z', 'C', 'O', 'D'};
inline constexpr SectionType kPackedBackward = {'Z', 'F', 'C', 'B'};
inline constexpr SectionType kPackedForward = {'Z', 'F', 'C', 'F'};
inline constexpr SectionType kCommand = {'C', 'M', 'N', 'D'};
inline constexpr SectionType kPins = {'P', 'I', 'N', 'S'};
inline constexpr SectionType kPinFrames = {'P', 'F', 'R', 'M'};
inline constexpr SectionType kPackedPins = {'Z', 'P', 'I', 'N'};
inline constexpr SectionType kLevels = {'L', 'E', 'V', 'L'};
inline constexpr SectionType kLevelMatter = {'L', 'M', 'A', 'T'};
inline constexpr SectionType kLevelBackward = {'L', 'A', 'T', 'B'};
inline constexpr SectionType kLevelForward = {'L', 'A', 'T', 'F'};
}  // namespace section

inline constexpr uint32_t kSectionOptional = 1;  ///< SectionEntry::flags

struct FileHeader {
  std::array<uint8_t, 8> magic;
  uint32_t version;
  uint32_t sectionCount;
  uint64_t fileBytes;
  uint64_t hash;
};
static_assert(sizeof(FileHeader) == 32 && offsetof(FileHeader, version) == 8 &&
              offsetof(FileHeader, sectionCount) == 12 && offsetof(FileHeader, fileBytes) == 16 &&
              offsetof(FileHeader, hash) == 24);

struct SectionEntry {
  SectionType type;
  uint32_t flags;
  uint64_t offset;
  uint64_t bytes;
  uint64_t items;
  uint64_t hash;
};
static_assert(sizeof(SectionEntry) == 40 && offsetof(SectionEntry, flags) == 4 && offsetof(SectionEntry, offset) == 8 &&
              offsetof(SectionEntry, bytes) == 16 && offsetof(SectionEntry, items) == 24 &&
              offsetof(SectionEntry, hash) == 32);

struct Metadata {
  int32_t dims[3];
  uint32_t brickEdge;
  double spacing[3];
  double origin[3];
  double direction[9];
  char lengthUnit[8];
  double codeLow;
  double codeStep;
  uint32_t codeLargest;
  uint32_t codeBytes;
  Classification classification;
  Layout layout;
  uint32_t levels;
  Hierarchy hierarchy;
  uint64_t voxels;
  uint64_t storedVoxels;
  uint64_t visibleVoxels;
  uint64_t nonFinite;
  uint64_t opacityHash;
  double largestValueError;
  uint64_t zero1;
};
static_assert(sizeof(Metadata) == 240 && offsetof(Metadata, dims) == 0 && offsetof(Metadata, brickEdge) == 12 &&
              offsetof(Metadata, spacing) == 16 && offsetof(Metadata, origin) == 40 &&
              offsetof(Metadata, direction) == 64 && offsetof(Metadata, lengthUnit) == 136 &&
              offsetof(Metadata, codeLow) == 144 && offsetof(Metadata, codeStep) == 152 &&
              offsetof(Metadata, codeLargest) == 160 && offsetof(Metadata, codeBytes) == 164 &&
              offsetof(Metadata, classification) == 168 && offsetof(Metadata, layout) == 172 &&
              offsetof(Metadata, levels) == 176 && offsetof(Metadata, hierarchy) == 180 &&
              offsetof(Metadata, voxels) == 184 && offsetof(Metadata, storedVoxels) == 192 &&
              offsetof(Metadata, visibleVoxels) == 200 && offsetof(Metadata, nonFinite) == 208 &&
              offsetof(Metadata, opacityHash) == 216 && offsetof(Metadata, largestValueError) == 224 &&
              offsetof(Metadata, zero1) == 232);

struct BrickEntry {
  uint64_t hilbertIndex;
  uint32_t visibleVoxels;
  uint32_t zero;
  uint64_t codesHash;
  uint64_t backwardHash;
  uint64_t forwardHash;
};
static_assert(sizeof(BrickEntry) == 40 && offsetof(BrickEntry, visibleVoxels) == 8 &&
              offsetof(BrickEntry, zero) == 12 && offsetof(BrickEntry, codesHash) == 16 &&
              offsetof(BrickEntry, backwardHash) == 24 && offsetof(BrickEntry, forwardHash) == 32);

struct FrameEntry {
  uint64_t offset[3];  ///< of codes, backward and forward faces, each in its section
  uint32_t bytes[3];
  uint32_t zero;
};
static_assert(sizeof(FrameEntry) == 40 && offsetof(FrameEntry, offset) == 0 && offsetof(FrameEntry, bytes) == 24 &&
              offsetof(FrameEntry, zero) == 36);

struct LevelEntry {
  uint32_t level;
  uint32_t zero0;
  uint64_t hilbertIndex;
  uint64_t offset[3];  ///< of matter, backward and forward attenuation, each in its section
  uint32_t bytes[3];
  uint32_t zero1;
  uint64_t hash[3];
};
static_assert(sizeof(LevelEntry) == 80 && offsetof(LevelEntry, zero0) == 4 && offsetof(LevelEntry, hilbertIndex) == 8 &&
              offsetof(LevelEntry, offset) == 16 && offsetof(LevelEntry, bytes) == 40 &&
              offsetof(LevelEntry, zero1) == 52 && offsetof(LevelEntry, hash) == 56);

/// Planes of a brick in LMAT: red, green, blue, extinction.
inline constexpr int kMatterPlanes = 4;

/// Brick edges that files may have: 4096-byte planes at 16; 32768 local positions, all that 16 bits hold, at 32.
constexpr bool validBrickEdge(int64_t edge) {
  return edge == 8 || edge == 16 || edge == 32;
}

}  // namespace freevoxel
