// The hashes in an attenuation file, XXH3-64 all of them (precompute/format.h says what each covers).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "precompute/format.h"

namespace freevoxel {

/// FileHeader::hash; the header's own hash field does not enter.
uint64_t headerHash(const FileHeader& header, std::span<const SectionEntry> sections);

/// Of some bytes: SectionEntry::hash of most sections, and the hashes in a BrickEntry.
uint64_t contentHash(std::span<const std::byte> bytes);

/// The same of bytes that come in pieces.
class ContentHash {
 public:
  ContentHash();
  ~ContentHash();
  ContentHash(const ContentHash&) = delete;
  ContentHash& operator=(const ContentHash&) = delete;
  void add(std::span<const std::byte> bytes);
  uint64_t value() const;  ///< of all bytes so far

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// SectionEntry::hash of a section whose bricks have a hash each, the member `hash` of their entries. So neither
/// writing nor checking a file reads brick data twice.
uint64_t brickSectionHash(std::span<const BrickEntry> bricks, uint64_t BrickEntry::*hash);

/// The same of LMAT, LATB or LATF (0, 1, 2).
uint64_t levelSectionHash(std::span<const LevelEntry> entries, size_t which);

}  // namespace freevoxel
