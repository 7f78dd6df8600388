#include "precompute/pin_writer.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <glm/common.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/first_exception.h"
#include "base/grid.h"
#include "base/mapped_file.h"
#include "precompute/brick_frames.h"
#include "precompute/checksums.h"
#include "precompute/format.h"
#include "precompute/hilbert.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

namespace {

uint64_t alignedUp(uint64_t offset, uint64_t alignment) {
  return (offset + alignment - 1) / alignment * alignment;
}

uint64_t alignmentOf(const SectionType& type) {
  const bool paged = type == section::kCodes || type == section::kBackward || type == section::kForward;
  return paged ? kPageBytes : kSectionAlignment;
}

/// A brick of a pin: a frame, or one value.
struct PackedBrick {
  PinFrameEntry entry{};
  Frame frame;
};

}  // namespace

struct PinWriter::State {
  MappedFile source;
  AtomicFile file;
  Metadata metadata{};
  std::vector<SectionEntry> sections;  ///< the source's, then those of the pins
  std::vector<PinEntry> pins;
  std::vector<PinFrameEntry> directory;
  ContentHash framesHash;
  size_t added = 0;

  State(const std::string& sourcePath, const std::string& path) : source(sourcePath), file(path) {}

  glm::ivec3 dims() const { return {metadata.dims[0], metadata.dims[1], metadata.dims[2]}; }
  int edge() const { return int(metadata.brickEdge); }
  SectionEntry& ofPins() { return sections[sections.size() - 3]; }
  SectionEntry& ofDirectory() { return sections[sections.size() - 2]; }
  SectionEntry& ofFrames() { return sections.back(); }

  void copySections();
  PackedBrick pack(std::span<const uint16_t> attenuation, glm::ivec3 position) const;
};

void PinWriter::State::copySections() {
  const auto bytes = source.bytes();
  FileHeader header;
  check(bytes.size() >= sizeof(header), "a sound attenuation file has a header");
  std::memcpy(&header, bytes.data(), sizeof(header));
  sections.resize(header.sectionCount);
  check(bytes.size() >= sizeof(header) + sections.size() * sizeof(SectionEntry), "and a section table");
  std::memcpy(sections.data(), bytes.data() + sizeof(header), sections.size() * sizeof(SectionEntry));
  const std::vector<SectionEntry> from = sections;
  for (const SectionEntry& entry : from) {
    check(entry.type != section::kPins, "pins are added to a file without pins");
    if (entry.type == section::kMetadata) std::memcpy(&metadata, bytes.data() + entry.offset, sizeof(metadata));
  }
  const uint64_t bricks = voxelCount(brickDims(dims(), edge()));
  directory.reserve(pins.size() * bricks);
  sections.push_back({section::kPins, kSectionOptional, 0, pins.size() * sizeof(PinEntry), pins.size(), 0});
  sections.push_back({section::kPinFrames, kSectionOptional, 0, pins.size() * bricks * sizeof(PinFrameEntry),
                      pins.size() * bricks, 0});
  sections.push_back({section::kPackedPins, kSectionOptional, 0, 0, pins.size(), 0});
  uint64_t end = sizeof(FileHeader) + sections.size() * sizeof(SectionEntry);
  for (size_t i = 0; i < sections.size(); ++i) {
    sections[i].offset = alignedUp(end, alignmentOf(sections[i].type));
    end = sections[i].offset + sections[i].bytes;
    if (i < from.size()) {
      file.writeAt(sections[i].offset, bytes.subspan(size_t(from[i].offset), size_t(from[i].bytes)));
      source.checkIntact();
    }
  }
}

PackedBrick PinWriter::State::pack(std::span<const uint16_t> attenuation, glm::ivec3 position) const {
  const int order = std::countr_zero(metadata.brickEdge);
  const auto curve = hilbertCurve(hilbertState(position, brickCurveOrder(dims(), edge())), order);
  std::vector<uint16_t> values(curve.size(), kPinnedOutside);
  uint16_t least = 65535, largest = 0;
  for (size_t step = 0; step < curve.size(); ++step) {
    const glm::ivec3 p = position * edge() + glm::ivec3(curve[step].x, curve[step].y, curve[step].z);
    if (p.x >= dims().x || p.y >= dims().y || p.z >= dims().z) continue;
    values[step] = attenuation[linearIndex(p, dims())];
    least = std::min(least, values[step]);
    largest = std::max(largest, values[step]);
  }
  PackedBrick packed;
  if (least == largest) {
    packed.entry.uniform = least;
    return packed;
  }
  packed.frame = packCodes(std::as_bytes(std::span(values)), kPinnedBytes);
  packed.entry.bytes = uint32_t(packed.frame.size());
  return packed;
}

PinWriter::PinWriter(const std::string& source, const std::string& path, std::span<const Pin> pins)
    : state_(std::make_unique<State>(source, path)) {
  state_->source.guard();
  for (const Pin& pin : pins)
    state_->pins.push_back({pin.directional ? 0u : 1u, 0, {pin.world.x, pin.world.y, pin.world.z}});
  state_->copySections();
}

PinWriter::~PinWriter() = default;

void PinWriter::add(std::span<const uint16_t> attenuation) {
  State& state = *state_;
  checkEqual(uint64_t(attenuation.size()), voxelCount(state.dims()), "voxels of a pin");
  check(state.added < state.pins.size(), "there is a pin for this attenuation");
  const glm::ivec3 bricks = brickDims(state.dims(), state.edge());
  std::vector<PackedBrick> packed(voxelCount(bricks));
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 8)
  for (int64_t i = 0; i < int64_t(packed.size()); ++i) {
    failure.guard([&] {
      const glm::ivec3 position(int(i % bricks.x), int(i / bricks.x % bricks.y),
                                int(i / (int64_t(bricks.x) * bricks.y)));
      packed[size_t(i)] = state.pack(attenuation, position);
    });
  }
  failure.rethrow();
  std::vector<std::byte> frames;
  for (const PackedBrick& brick : packed) {
    state.directory.push_back(brick.entry);
    frames.insert(frames.end(), brick.frame.begin(), brick.frame.end());
  }
  SectionEntry& section = state.ofFrames();
  state.file.writeAt(section.offset + section.bytes, frames);
  state.framesHash.add(frames);
  section.bytes += frames.size();
  ++state.added;
}

uint64_t PinWriter::commit() {
  State& state = *state_;
  checkEqual(state.added, state.pins.size(), "pins that were added");
  const auto write = [&](SectionEntry& section, std::span<const std::byte> bytes) {
    checkEqual(uint64_t(bytes.size()), section.bytes, "bytes of a section");
    section.hash = contentHash(bytes);
    state.file.writeAt(section.offset, bytes);
  };
  write(state.ofPins(), std::as_bytes(std::span(state.pins)));
  write(state.ofDirectory(), std::as_bytes(std::span(state.directory)));
  state.ofFrames().hash = state.framesHash.value();
  const uint64_t fileBytes = state.ofFrames().offset + state.ofFrames().bytes;
  state.file.truncate(fileBytes);
  state.file.sync();
  // As in precompute: without the header nothing takes the file for an attenuation file.
  FileHeader header{kFileMagic, kFileVersion, uint32_t(state.sections.size()), fileBytes, 0};
  header.hash = headerHash(header, state.sections);
  state.file.writeAt(sizeof(FileHeader), std::as_bytes(std::span(state.sections)));
  state.file.writeAt(0, std::as_bytes(std::span(&header, 1)));
  state.file.commit();
  return fileBytes;
}

}  // namespace freevoxel
