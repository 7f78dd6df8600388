// Levels from 1 on of the mapped reader.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <glm/glm.hpp>
#include <numeric>
#include <utility>

#include "base/error.h"
#include "base/grid.h"
#include "hierarchy/attenuation_file.h"
#include "hierarchy/file_reading.h"
#include "precompute/brick_frames.h"
#include "precompute/checksums.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

namespace {

constexpr std::array<SectionType, 3> kSections = {section::kLevelMatter, section::kLevelBackward,
                                                  section::kLevelForward};

/// Above the largest that is no infinity and not a number.
constexpr uint16_t kHalfInfinity = 0x7c00;

}  // namespace

glm::ivec3 AttenuationFile::levelDims(int level) const {
  check(level >= 0 && level < levels(), "level is in the file");
  return dimsOfLevel(dims(), level);
}

size_t AttenuationFile::levelBrickCount(int level) const {
  check(level >= 0 && level < levels(), "level is in the file");
  if (level == 0) return brickCount();
  return levelStarts_[size_t(level) + 1] - levelStarts_[size_t(level)];
}

glm::ivec3 AttenuationFile::levelBrickOrigin(int level, size_t i) const {
  if (level == 0) return brickOrigin(i);
  check(i < levelBrickCount(level), "brick number is in range");
  return hilbertPosition(levelEntries_[levelStarts_[size_t(level)] + i].hilbertIndex, curveOrder_ - level) *
         brickEdge();
}

std::optional<size_t> AttenuationFile::findLevelBrick(int level, glm::ivec3 brickPosition) const {
  if (level == 0) return findBrick(brickPosition);
  if (glm::any(glm::lessThan(brickPosition, glm::ivec3(0))) ||
      glm::any(glm::greaterThanEqual(brickPosition, brickDims(levelDims(level), brickEdge())))) {
    return std::nullopt;
  }
  const uint64_t index = hilbertIndex(brickPosition, curveOrder_ - level);
  const auto begin = levelEntries_.begin() + ptrdiff_t(levelStarts_[size_t(level)]);
  const auto end = levelEntries_.begin() + ptrdiff_t(levelStarts_[size_t(level) + 1]);
  const auto found = std::lower_bound(
      begin, end, index, [](const LevelEntry& entry, uint64_t value) { return entry.hilbertIndex < value; });
  if (found == end || found->hilbertIndex != index) return std::nullopt;
  return size_t(found - begin);
}

uint64_t AttenuationFile::levelBytes() const {
  return levelData_[0].size() + levelData_[1].size() + levelData_[2].size();
}

void AttenuationFile::readLevels() {
  levelStarts_.assign(size_t(levels()) + 1, 0);
  const SectionType types[] = {section::kLevels, kSections[0], kSections[1], kSections[2]};
  if (levels() == 1) {
    for (const SectionType& type : types) {
      if (const SectionEntry* entry = find(type)) {
        throw mismatch(path_, entry->offset, fmt::format("section {}", text(type)), "none, as there is one level",
                       "one");
      }
    }
    return;
  }
  const SectionEntry& section = required(section::kLevels);
  if (checkedProduct(section.items, sizeof(LevelEntry)) != section.bytes) {
    throw mismatch(path_, section.offset, "directory of levels", fmt::format("{} bytes an item", sizeof(LevelEntry)),
                   fmt::format("{} items in {} bytes", section.items, section.bytes));
  }
  verifySection(section);
  levelEntries_ = copyOf<LevelEntry>(content(section));
  readLevelEntries(section);
  for (size_t which = 0; which < kSections.size(); ++which) {
    const SectionEntry& frames = required(kSections[which]);
    levelData_[which] = content(frames);
    checkFrameList(
        path_, frames, levelEntries_.size(), section.offset, sizeof(LevelEntry),
        [&](size_t i) { return std::pair(levelEntries_[i].offset[which], levelEntries_[i].bytes[which]); },
        offsetof(LevelEntry, offset) + which * sizeof(uint64_t),
        offsetof(LevelEntry, bytes) + which * sizeof(uint32_t));
  }
}

void AttenuationFile::readLevelEntries(const SectionEntry& section) {
  uint32_t level = 1;
  uint64_t next = 0;
  // Bricks that must be there: those of the level below, one order lower.
  std::vector<uint64_t> expected;
  for (const BrickEntry& brick : bricks_) {
    if (expected.empty() || expected.back() != brick.hilbertIndex >> 3) expected.push_back(brick.hilbertIndex >> 3);
  }
  for (size_t i = 0; i <= levelEntries_.size(); ++i) {
    // A level ends where all of its bricks have come.
    while (next == expected.size() && level < metadata_.levels) {
      levelStarts_[++level] = i;
      next = 0;
      for (uint64_t& index : expected)
        index >>= 3;
      expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
    }
    if (i == levelEntries_.size()) break;
    const LevelEntry& entry = levelEntries_[i];
    const uint64_t at = section.offset + i * sizeof(LevelEntry);
    const bool known = level < metadata_.levels && next < expected.size();
    const uint64_t index = known ? expected[next] : 0;
    if (!known) {
      throw mismatch(path_, at, "directory of levels", fmt::format("{} bricks", i), levelEntries_.size());
    }
    if (entry.level != level) throw mismatch(path_, at, fmt::format("level of entry {}", i), level, entry.level);
    if (entry.hilbertIndex != index) {
      throw mismatch(path_, at + offsetof(LevelEntry, hilbertIndex), fmt::format("Hilbert index of entry {}", i), index,
                     entry.hilbertIndex);
    }
    for (const auto& [zero, field] :
         {std::pair(entry.zero0, offsetof(LevelEntry, zero0)), std::pair(entry.zero1, offsetof(LevelEntry, zero1))}) {
      if (zero != 0) throw mismatch(path_, at + field, "reserved field", 0, zero);
    }
    ++next;
  }
  if (level != metadata_.levels || next != 0) {
    throw mismatch(path_, section.offset, "directory of levels",
                   fmt::format("all bricks of levels 1 to {}", metadata_.levels - 1),
                   fmt::format("an end after {} of level {}", next, level));
  }
}

std::span<const std::byte> AttenuationFile::storedLevel(size_t which, const LevelEntry& entry) const {
  return levelData_[which].subspan(size_t(entry.offset[which]), entry.bytes[which]);
}

BrickView AttenuationFile::levelBrick(int level, size_t i, DirectionSet directions, bool matter) const {
  if (level == 0) return brick(i, directions);
  check(i < levelBrickCount(level), "brick number is in range");
  const size_t number = levelStarts_[size_t(level)] + i;
  const LevelEntry& entry = levelEntries_[number];
  const int order = curveOrder_ - level;
  const glm::ivec3 position = hilbertPosition(entry.hilbertIndex, order);
  const int state = hilbertState(position, order);
  const int brickOrder = std::countr_zero(metadata_.brickEdge);
  BrickView view;
  view.hilbertIndex = entry.hilbertIndex;
  view.origin = position * brickEdge();
  view.edge = brickEdge();
  view.level = level;
  view.curve = hilbertCurve(state, brickOrder);
  view.steps = hilbertSteps(state, brickOrder);
  const auto expectSound = [&](const std::optional<std::string>& problem, size_t which) {
    if (!problem) return;
    throw InputError(fmt::format("{}: at byte {}: brick {} of level {} in section {}: {}", path_,
                                 required(kSections[which]).offset + entry.offset[which], i, level,
                                 text(kSections[which]), *problem));
  };
  const size_t voxels = size_t(brickVoxels());
  const size_t matterBytes = matter ? kMatterPlanes * voxels * sizeof(uint16_t) : 0;
  const auto ofPass = [&](int pass) {
    constexpr DirectionSet kOfPass = (DirectionSet(1) << kDirectionsPerSection) - 1;
    return (directions >> (pass * kDirectionsPerSection) & kOfPass) != 0;
  };
  const size_t passes = (ofPass(0) ? 1u : 0u) + (ofPass(1) ? 1u : 0u);
  view.unpacked = std::make_unique_for_overwrite<std::byte[]>(matterBytes + passes * kDirectionsPerSection * voxels);
  if (matter) {
    expectSound(unpackCodes(storedLevel(0, entry), 2, {view.unpacked.get(), matterBytes}), 0);
    const auto* planes = reinterpret_cast<const uint16_t*>(view.unpacked.get());
    for (size_t plane = 0; plane < kMatterPlanes; ++plane)
      view.matter[plane] = planes + plane * voxels;
    // Negative, infinite or no number: none is an extinction.
    const uint16_t* extinction = view.matter[kMatterPlanes - 1];
    if (const uint16_t largest = *std::max_element(extinction, extinction + voxels); largest >= kHalfInfinity) {
      expectSound(fmt::format("expected extinctions below 0x{:04x}, found 0x{:04x}", kHalfInfinity, largest), 0);
    }
  }
  std::byte* planes = view.unpacked.get() + matterBytes;
  for (int pass = 0; pass < 2; ++pass) {
    if (!ofPass(pass)) continue;
    const size_t which = size_t(pass) + 1;
    expectSound(unpackCodes(storedLevel(which, entry), 1, {planes, kDirectionsPerSection * voxels}), which);
    for (int k = 0; k < kDirectionsPerSection; ++k) {
      view.attenuations[pass * kDirectionsPerSection + k] =
          reinterpret_cast<const uint8_t*>(planes) + size_t(k) * voxels;
    }
    planes += kDirectionsPerSection * voxels;
  }
  return view;
}

void AttenuationFile::verifyLevels() const {
  if (levels() == 1) return;
  for (size_t which = 0; which < kSections.size(); ++which)
    verifyHash(required(kSections[which]), levelSectionHash(levelEntries_, which));
  for (size_t entry = 0; entry < levelEntries_.size(); ++entry)
    verifyLevelEntry(entry);
}

void AttenuationFile::verifyLevelEntry(size_t i) const {
  const LevelEntry& entry = levelEntries_[i];
  for (size_t which = 0; which < kSections.size(); ++which) {
    if (const uint64_t hash = contentHash(storedLevel(which, entry)); hash != entry.hash[which]) {
      throw mismatch(path_, required(kSections[which]).offset + entry.offset[which],
                     fmt::format("checksum of entry {} in section {}", i, text(kSections[which])),
                     fmt::format("{:016x}", entry.hash[which]), fmt::format("{:016x}", hash));
    }
  }
  // Frames with the right checksum can still be no frames.
  levelBrick(int(entry.level), i - levelStarts_[entry.level]);
}

void AttenuationFile::prefetch(int level, size_t i) const {
  static const auto kPage = uintptr_t(sysconf(_SC_PAGESIZE));
  for (size_t which = 0; which < 3; ++which) {
    const std::span<const std::byte> bytes =
        level == 0 ? stored(which, i) : storedLevel(which, levelEntries_[levelStarts_[size_t(level)] + i]);
    if (bytes.empty()) continue;
    const auto from = reinterpret_cast<uintptr_t>(bytes.data()) / kPage * kPage;
    const auto to = reinterpret_cast<uintptr_t>(bytes.data() + bytes.size());
    // Only a hint: where it fails, reading works all the same.
    (void)madvise(reinterpret_cast<void*>(from), to - from, MADV_WILLNEED);
  }
}

}  // namespace freevoxel
