#include "precompute/brick_store.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "base/error.h"
#include "precompute/checksums.h"
#include "precompute/hilbert.h"

namespace freevoxel {

BrickStore::BrickStore(std::span<const StoredBrick> bricks) {
  entries_.reserve(bricks.size());
  for (const StoredBrick& brick : bricks)
    entries_.push_back({brick.hilbertIndex, brick.visibleVoxels, 0, 0, 0, 0});
}

DenseStore::DenseStore(AtomicFile& file, const Offsets& offsets, std::span<const StoredBrick> bricks, int edge,
                       int bytesPerCode)
    : BrickStore(bricks), file_(file), offsets_(offsets) {
  const uint64_t voxels = uint64_t(edge) * uint64_t(edge) * uint64_t(edge);
  codeBytes_ = voxels * uint64_t(bytesPerCode);
  attenuationBytes_ = voxels * kDirectionsPerSection;
}

void DenseStore::codes(size_t first, std::span<const std::byte> planes) {
  const size_t count = planes.size() / codeBytes_;
  for (size_t i = 0; i < count; ++i)
    entries_[first + i].codesHash = contentHash(planes.subspan(i * codeBytes_, codeBytes_));
  file_.writeAt(offsets_.codes + first * codeBytes_, planes);
}

void DenseStore::attenuation(int pass, size_t brick, std::span<const uint8_t> planes) {
  const auto hash = pass == 0 ? &BrickEntry::backwardHash : &BrickEntry::forwardHash;
  entries_[brick].*hash = contentHash(std::as_bytes(planes));
  file_.writeAt((pass == 0 ? offsets_.backward : offsets_.forward) + brick * attenuationBytes_, std::as_bytes(planes));
}

CompactStore::CompactStore(AtomicFile& file, const std::array<uint64_t, 3>& offsets,
                           std::span<const StoredBrick> bricks, glm::ivec3 dims, int edge, int bytesPerCode)
    : BrickStore(bricks), file_(file), edge_(edge), bytesPerCode_(bytesPerCode), frames_(bricks.size()) {
  const int order = brickCurveOrder(dims, edge);
  for (const StoredBrick& brick : bricks)
    steps_.push_back(hilbertSteps(hilbertState(brick.position, order), std::countr_zero(unsigned(edge))));
  for (size_t which = 0; which < sections_.size(); ++which)
    sections_[which].offset = offsets[which];
}

void CompactStore::codes(size_t first, std::span<const std::byte> planes) {
  const size_t bytes = steps_[first].size() * size_t(bytesPerCode_);
  for (size_t i = 0; i * bytes < planes.size(); ++i) {
    Frame frame = packCodes(planes.subspan(i * bytes, bytes), bytesPerCode_);
    entries_[first + i].codesHash = contentHash(frame);
    wait(0, first + i, std::move(frame));
  }
}

void CompactStore::attenuation(int pass, size_t brick, std::span<const uint8_t> planes) {
  Frame frame = packFaces(planes, steps_[brick], pass, edge_);
  const auto hash = pass == 0 ? &BrickEntry::backwardHash : &BrickEntry::forwardHash;
  entries_[brick].*hash = contentHash(frame);
  wait(size_t(pass) + 1, brick, std::move(frame));
}

void CompactStore::wait(size_t section, size_t brick, Frame frame) {
  const std::lock_guard lock(mutex_);
  waiting_[section].push_back({brick, std::move(frame)});
}

void CompactStore::write(size_t which, uint64_t offset, std::span<const std::byte> frames) {
  file_.writeAt(sections_[which].offset + offset, frames);
}

void KeptCompactStore::write(size_t which, uint64_t /*offset*/, std::span<const std::byte> frames) {
  kept_[which].insert(kept_[which].end(), frames.begin(), frames.end());
}

void CompactStore::endSlab() {
  for (size_t which = 0; which < sections_.size(); ++which) {
    Section& section = sections_[which];
    std::vector<Waiting>& waiting = waiting_[which];
    std::sort(waiting.begin(), waiting.end(), [](const Waiting& a, const Waiting& b) { return a.brick < b.brick; });
    size_t bytes = 0;
    for (const auto& [brick, frame] : waiting)
      bytes += frame.size();
    Frame joined;
    joined.reserve(bytes);
    for (const auto& [brick, frame] : waiting) {
      frames_[brick].offset[which] = section.bytes + joined.size();
      frames_[brick].bytes[which] = uint32_t(frame.size());
      joined.insert(joined.end(), frame.begin(), frame.end());
    }
    waiting.clear();
    write(which, section.bytes, joined);
    section.bytes += joined.size();
  }
}

}  // namespace freevoxel
