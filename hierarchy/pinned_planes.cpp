#include "hierarchy/pinned_planes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <glm/common.hpp>

#include "base/error.h"
#include "base/grid.h"
#include "precompute/brick_frames.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

namespace {

template <class Expected, class Found>
InputError mismatch(const std::string& path, uint64_t offset, const std::string& what, const Expected& expected,
                    const Found& found) {
  return InputError(fmt::format("{}: at byte {}: {}: expected {}, found {}", path, offset, what, expected, found));
}

/// Throws unless the section holds `items` whole entries and nothing else.
template <class Entry>
std::vector<Entry> entriesOf(const std::string& path, const PinSections::Section& section, const char* name,
                             uint64_t items) {
  if (section.items != items || checkedProduct(items, sizeof(Entry)) != uint64_t(section.bytes.size())) {
    throw mismatch(path, section.offset, fmt::format("section {}", name),
                   fmt::format("{} items of {} bytes", items, sizeof(Entry)),
                   fmt::format("{} in {} bytes", section.items, section.bytes.size()));
  }
  std::vector<Entry> entries(items);
  if (!entries.empty()) std::memcpy(entries.data(), section.bytes.data(), section.bytes.size());
  return entries;
}

}  // namespace

PinnedPlanes::PinnedPlanes(const std::string& path, const PinSections& sections, glm::ivec3 dims, int edge)
    : path_(path),
      bricks_(brickDims(dims, edge)),
      edge_(edge),
      frames_(sections.frames.bytes),
      framesOffset_(sections.frames.offset) {
  readPins(sections.pins);
  readDirectory(sections.directory);
  if (sections.frames.items != pins_.size())
    throw mismatch(path_, framesOffset_, "items of ZPIN", pins_.size(), sections.frames.items);
  bytes_ = sections.pins.bytes.size() + sections.directory.bytes.size() + frames_.size();
}

void PinnedPlanes::readPins(const PinSections::Section& section) {
  const auto entries = entriesOf<PinEntry>(path_, section, "PINS", section.bytes.size() / sizeof(PinEntry));
  for (size_t i = 0; i < entries.size(); ++i) {
    const PinEntry& entry = entries[i];
    const uint64_t at = section.offset + i * sizeof(PinEntry);
    const std::string name = fmt::format("pin {}", i);
    if (entry.kind > 1) throw mismatch(path_, at, name, "kind 0 or 1", entry.kind);
    if (entry.zero != 0) throw mismatch(path_, at + offsetof(PinEntry, zero), name + ": reserved field", 0, entry.zero);
    const glm::dvec3 world(entry.world[0], entry.world[1], entry.world[2]);
    const bool finite = std::isfinite(world.x) && std::isfinite(world.y) && std::isfinite(world.z);
    if (!finite || (entry.kind == 0 && world == glm::dvec3(0.0))) {
      throw mismatch(path_, at + offsetof(PinEntry, world), name, "finite numbers, of a direction not all 0",
                     fmt::format("{} {} {}", world.x, world.y, world.z));
    }
    pins_.push_back({entry.kind == 0, world});
  }
}

void PinnedPlanes::readDirectory(const PinSections::Section& section) {
  const auto count = checkedProduct(pins_.size(), voxelCount(bricks_));
  if (!count) throw mismatch(path_, section.offset, "section PFRM", "fewer pins", pins_.size());
  directory_ = entriesOf<PinFrameEntry>(path_, section, "PFRM", *count);
  offsets_.reserve(directory_.size());
  uint64_t end = 0;
  for (size_t i = 0; i < directory_.size(); ++i) {
    const PinFrameEntry& entry = directory_[i];
    const uint64_t at = section.offset + i * sizeof(PinFrameEntry);
    if (entry.bytes > frames_.size() - end) {
      throw mismatch(path_, at, fmt::format("bytes of frame {} in ZPIN", i),
                     fmt::format("at most {}", frames_.size() - end), entry.bytes);
    }
    if (entry.uniform > (entry.bytes == 0 ? 65535u : 0u)) {
      throw mismatch(path_, at + offsetof(PinFrameEntry, uniform), fmt::format("attenuation of uniform brick {}", i),
                     entry.bytes == 0 ? "at most 65535" : "0", entry.uniform);
    }
    offsets_.push_back(end);
    end += entry.bytes;
  }
  if (end != frames_.size()) throw mismatch(path_, framesOffset_, "bytes of ZPIN", end, frames_.size());
}

void PinnedPlanes::unpack(size_t pin, glm::ivec3 position, std::span<uint16_t> attenuation) const {
  check(pin < pins_.size(), "pin number is in range");
  check(glm::clamp(position, glm::ivec3(0), bricks_ - 1) == position, "brick lies in the volume");
  checkEqual(attenuation.size(), size_t(edge_) * size_t(edge_) * size_t(edge_), "voxels of a brick");
  const size_t i = pin * size_t(voxelCount(bricks_)) + size_t(linearIndex(position, bricks_));
  const PinFrameEntry& entry = directory_[i];
  if (entry.bytes == 0) {
    std::fill(attenuation.begin(), attenuation.end(), uint16_t(entry.uniform));
    return;
  }
  const auto frame = frames_.subspan(size_t(offsets_[i]), entry.bytes);
  if (const auto problem = unpackCodes(frame, kPinnedBytes, std::as_writable_bytes(attenuation))) {
    throw InputError(fmt::format("{}: at byte {}: brick {} {} {} of pin {}: {}", path_, framesOffset_ + offsets_[i],
                                 position.x, position.y, position.z, pin, *problem));
  }
}

void PinnedPlanes::verify() const {
  std::vector<uint16_t> attenuation(size_t(edge_) * size_t(edge_) * size_t(edge_));
  for (size_t pin = 0; pin < pins_.size(); ++pin) {
    for (int z = 0; z < bricks_.z; ++z) {
      for (int y = 0; y < bricks_.y; ++y) {
        for (int x = 0; x < bricks_.x; ++x)
          unpack(pin, {x, y, z}, attenuation);
      }
    }
  }
}

}  // namespace freevoxel
