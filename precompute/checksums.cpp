#include "precompute/checksums.h"

#include <xxhash.h>

#include <new>
#include <vector>

namespace freevoxel {

uint64_t headerHash(const FileHeader& header, std::span<const SectionEntry> sections) {
  const auto headerBytes = std::as_bytes(std::span(&header, 1)).first(offsetof(FileHeader, hash));
  const auto sectionBytes = std::as_bytes(sections);
  std::vector<std::byte> bytes(headerBytes.begin(), headerBytes.end());
  bytes.insert(bytes.end(), sectionBytes.begin(), sectionBytes.end());
  return contentHash(bytes);
}

uint64_t contentHash(std::span<const std::byte> bytes) {
  return XXH3_64bits(bytes.data(), bytes.size());
}

struct ContentHash::State {
  XXH3_state_t* hash = XXH3_createState();
  ~State() { XXH3_freeState(hash); }
};

ContentHash::ContentHash() : state_(std::make_unique<State>()) {
  if (state_->hash == nullptr) throw std::bad_alloc();
  XXH3_64bits_reset(state_->hash);
}

ContentHash::~ContentHash() = default;

void ContentHash::add(std::span<const std::byte> bytes) {
  XXH3_64bits_update(state_->hash, bytes.data(), bytes.size());
}

uint64_t ContentHash::value() const {
  return XXH3_64bits_digest(state_->hash);
}

uint64_t brickSectionHash(std::span<const BrickEntry> bricks, uint64_t BrickEntry::*hash) {
  std::vector<uint64_t> hashes;
  hashes.reserve(bricks.size());
  for (const BrickEntry& brick : bricks)
    hashes.push_back(brick.*hash);
  return contentHash(std::as_bytes(std::span(hashes)));
}

uint64_t levelSectionHash(std::span<const LevelEntry> entries, size_t which) {
  std::vector<uint64_t> hashes;
  hashes.reserve(entries.size());
  for (const LevelEntry& entry : entries)
    hashes.push_back(entry.hash[which]);
  return contentHash(std::as_bytes(std::span(hashes)));
}

}  // namespace freevoxel
