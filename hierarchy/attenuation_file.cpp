#include "hierarchy/attenuation_file.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <numeric>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/grid.h"
#include "hierarchy/file_reading.h"
#include "precompute/brick_faces.h"
#include "precompute/brick_frames.h"
#include "precompute/checksums.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

namespace {

constexpr std::array<SectionType, 3> kDenseBricks = {section::kCodes, section::kBackward, section::kForward};
constexpr std::array<SectionType, 3> kCompactBricks = {section::kPackedCodes, section::kPackedBackward,
                                                       section::kPackedForward};

constexpr std::array<SectionType, 3> kLevelBricks = {section::kLevelMatter, section::kLevelBackward,
                                                     section::kLevelForward};

bool isAmong(std::span<const SectionType> types, const SectionType& type) {
  return std::find(types.begin(), types.end(), type) != types.end();
}

bool isKnown(const SectionType& type) {
  constexpr SectionType kOthers[] = {
      section::kMetadata, section::kTransfer, section::kDirections, section::kBricks,     section::kFrames,
      section::kCommand,  section::kPins,     section::kPinFrames,  section::kPackedPins, section::kLevels};
  return isAmong(kOthers, type) || isAmong(kDenseBricks, type) || isAmong(kCompactBricks, type) ||
         isAmong(kLevelBricks, type);
}

bool holdsBrickData(const SectionType& type) {
  return isAmong(kDenseBricks, type) || isAmong(kCompactBricks, type) || isAmong(kLevelBricks, type);
}

uint32_t largestCode(std::span<const std::byte> codes, int bytesPerCode) {
  const auto largest = [&]<class Code>(const Code* begin) {
    Code result = 0;
    for (size_t i = 0; i < codes.size() / sizeof(Code); ++i)
      result = std::max(result, begin[i]);
    return uint32_t(result);
  };
  return bytesPerCode == 1 ? largest(reinterpret_cast<const uint8_t*>(codes.data()))
                           : largest(reinterpret_cast<const uint16_t*>(codes.data()));
}

/// The hashes of what brickSections() hold of a brick.
constexpr std::array<uint64_t BrickEntry::*, 3> kBrickHashes = {&BrickEntry::codesHash, &BrickEntry::backwardHash,
                                                                &BrickEntry::forwardHash};

}  // namespace

AttenuationFile::AttenuationFile(const std::string& path) : path_(path), map_(path) {
  map_.guard();
  readHeader();
  readMetadata();
  readTransfer();
  readDirections();
  readBricks();
  readPins();
  readLevels();
  checkIntact();
}

std::span<const std::byte> AttenuationFile::content(const SectionEntry& entry) const {
  return map_.bytes().subspan(size_t(entry.offset), size_t(entry.bytes));
}

const SectionEntry* AttenuationFile::find(SectionType type) const {
  const auto found = std::find_if(sections_.begin(), sections_.end(), [&](const auto& s) { return s.type == type; });
  return found == sections_.end() ? nullptr : &*found;
}

const SectionEntry& AttenuationFile::required(SectionType type) const {
  const SectionEntry* entry = find(type);
  if (entry == nullptr) {
    throw mismatch(path_, sizeof(FileHeader), "section table", fmt::format("a section {}", text(type)), "none");
  }
  return *entry;
}

void AttenuationFile::readHeader() {
  const auto bytes = map_.bytes();
  const size_t present = std::min(bytes.size(), kFileMagic.size());
  if (present < kFileMagic.size() || std::memcmp(bytes.data(), kFileMagic.data(), present) != 0) {
    throw mismatch(path_, 0, "magic", "an attenuation file (.fvx)", "something else");
  }
  if (bytes.size() < sizeof(FileHeader)) {
    throw mismatch(path_, bytes.size(), "header", fmt::format("{} bytes", sizeof(FileHeader)), "the end of the file");
  }
  const auto header = copyAt<FileHeader>(bytes, 0);
  if (header.version != kFileVersion) {
    throw mismatch(path_, offsetof(FileHeader, version), "version", kFileVersion, header.version);
  }
  if (header.fileBytes != bytes.size()) {
    throw mismatch(path_, offsetof(FileHeader, fileBytes), "bytes in the file", header.fileBytes, bytes.size());
  }
  readSectionTable(header);
}

void AttenuationFile::readSectionTable(const FileHeader& header) {
  const auto bytes = map_.bytes();
  const uint64_t room = (bytes.size() - sizeof(FileHeader)) / sizeof(SectionEntry);
  const uint64_t largest = std::min<uint64_t>(room, kLargestSectionCount);
  if (header.sectionCount > largest) {
    throw mismatch(path_, offsetof(FileHeader, sectionCount), "number of sections", fmt::format("at most {}", largest),
                   header.sectionCount);
  }
  sections_.resize(header.sectionCount);
  uint64_t end = sizeof(FileHeader) + sections_.size() * sizeof(SectionEntry);
  if (!sections_.empty()) std::memcpy(sections_.data(), bytes.data() + sizeof(FileHeader), end - sizeof(FileHeader));
  if (const uint64_t hash = headerHash(header, sections_); hash != header.hash) {
    throw mismatch(path_, offsetof(FileHeader, hash), "checksum of header and section table",
                   fmt::format("{:016x}", header.hash), fmt::format("{:016x}", hash));
  }
  hash_ = header.hash;
  for (size_t i = 0; i < sections_.size(); ++i) {
    const SectionEntry& entry = sections_[i];
    const uint64_t at = sizeof(FileHeader) + i * sizeof(SectionEntry);
    const std::string name = "section " + quoted(entry.type);
    if ((entry.flags & ~kSectionOptional) != 0) {
      throw mismatch(path_, at + offsetof(SectionEntry, flags), name + ": flags", "0 or 1", entry.flags);
    }
    if (!isKnown(entry.type) && (entry.flags & kSectionOptional) == 0) {
      throw mismatch(path_, at, "section type", "one that this version knows", quoted(entry.type));
    }
    if (find(entry.type) != &entry) throw mismatch(path_, at, name, "one of its type", "a second one");
    const uint64_t alignment = isAmong(kDenseBricks, entry.type) ? kPageBytes : kSectionAlignment;
    if (entry.offset < end || entry.offset % alignment != 0) {
      throw mismatch(path_, at + offsetof(SectionEntry, offset), name + ": offset",
                     fmt::format("a multiple of {}, at least {}", alignment, end), entry.offset);
    }
    const auto sectionEnd = checkedSum(entry.offset, entry.bytes);
    if (!sectionEnd || *sectionEnd > bytes.size()) {
      throw mismatch(path_, at + offsetof(SectionEntry, bytes), name + ": bytes",
                     fmt::format("at most {}", bytes.size() - std::min<uint64_t>(entry.offset, bytes.size())),
                     entry.bytes);
    }
    end = *sectionEnd;
  }
  if (end != bytes.size()) throw mismatch(path_, end, "after the last section", "the end of the file", "more bytes");
}

void AttenuationFile::readMetadata() {
  const SectionEntry& entry = required(section::kMetadata);
  if (entry.items != 1 || entry.bytes != sizeof(Metadata)) {
    throw mismatch(path_, entry.offset, "metadata", fmt::format("1 item of {} bytes", sizeof(Metadata)),
                   fmt::format("{} of {}", entry.items, entry.bytes));
  }
  verifySection(entry);
  metadata_ = copyAt<Metadata>(map_.bytes(), entry.offset);
  const Metadata& m = metadata_;
  const auto expect = [&](bool holds, size_t field, std::string_view what, std::string_view expected,
                          const auto& found) {
    if (!holds) throw mismatch(path_, entry.offset + field, what, expected, found);
  };
  expect(validDims(dims()), offsetof(Metadata, dims), "dims", "1 to 2097152 voxels along each axis",
         fmt::format("{} {} {}", m.dims[0], m.dims[1], m.dims[2]));
  expect(validBrickEdge(m.brickEdge), offsetof(Metadata, brickEdge), "brick edge", "8, 16 or 32", m.brickEdge);
  for (size_t axis = 0; axis < 3; ++axis) {
    expect(std::isfinite(m.spacing[axis]) && m.spacing[axis] > 0.0, offsetof(Metadata, spacing) + axis * sizeof(double),
           "spacing", "a positive number", m.spacing[axis]);
    expect(std::isfinite(m.origin[axis]), offsetof(Metadata, origin) + axis * sizeof(double), "origin",
           "a finite number", m.origin[axis]);
  }
  placement_.spacing = {m.spacing[0], m.spacing[1], m.spacing[2]};
  placement_.origin = {m.origin[0], m.origin[1], m.origin[2]};
  for (int i = 0; i < 9; ++i)
    placement_.direction[i / 3][i % 3] = m.direction[i];
  const double determinant = glm::determinant(placement_.direction);
  expect(std::isfinite(determinant) && std::abs(determinant) > 1e-6, offsetof(Metadata, direction),
         "determinant of the direction", "a number that is not 0", determinant);
  expect(std::isfinite(m.codeLow), offsetof(Metadata, codeLow), "value of code 0", "a finite number", m.codeLow);
  expect(std::isfinite(m.codeStep) && m.codeStep > 0.0, offsetof(Metadata, codeStep), "value step", "a positive number",
         m.codeStep);
  expect(m.codeLargest >= 1 && m.codeLargest <= 65535, offsetof(Metadata, codeLargest), "largest code", "1 to 65535",
         m.codeLargest);
  coding_ = {m.codeLow, m.codeStep, m.codeLargest};
  expect(std::isfinite(coding_.decode(m.codeLargest)), offsetof(Metadata, codeStep), "value of the largest code",
         "a finite number", coding_.decode(m.codeLargest));
  expect(m.codeBytes == uint32_t(coding_.bytes()), offsetof(Metadata, codeBytes), "bytes per code",
         coding_.bytes() == 1 ? "1" : "2", m.codeBytes);
  expect(m.classification == Classification::voxel || m.classification == Classification::preintegrated,
         offsetof(Metadata, classification), "classification", "0 or 1", uint32_t(m.classification));
  expect(m.layout == Layout::dense || m.layout == Layout::compact, offsetof(Metadata, layout), "layout",
         "0, dense, or 1, compact", uint32_t(m.layout));
  const int mostLevels = mostHierarchyLevels(dims(), int(m.brickEdge));
  expect(m.levels >= 1 && m.levels <= uint32_t(mostLevels), offsetof(Metadata, levels), "levels",
         fmt::format("1 to {}", mostLevels), m.levels);
  expect(m.hierarchy == Hierarchy::geometric || (m.hierarchy == Hierarchy::weighted && m.levels > 1),
         offsetof(Metadata, hierarchy), "hierarchy", m.levels > 1 ? "0, geometric, or 1, weighted" : "0",
         uint32_t(m.hierarchy));
  expect(m.zero1 == 0, offsetof(Metadata, zero1), "reserved field", "0", m.zero1);
  const uint64_t voxels = voxelCount(dims());
  expect(m.voxels == voxels, offsetof(Metadata, voxels), "voxels", fmt::format("{}", voxels), m.voxels);
  expect(m.nonFinite <= voxels, offsetof(Metadata, nonFinite), "non-finite voxels", fmt::format("at most {}", voxels),
         m.nonFinite);
  expect(m.largestValueError >= 0.0, offsetof(Metadata, largestValueError), "largest value error", "0 or more",
         m.largestValueError);
}

void AttenuationFile::readTransfer() {
  const SectionEntry& entry = required(section::kTransfer);
  if (entry.items != entry.bytes) throw mismatch(path_, entry.offset, "items of XFER", entry.bytes, entry.items);
  verifySection(entry);
  const auto bytes = content(entry);
  const std::string json(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  transfer_ = parseTransferFunction(json, fmt::format("{}: transfer function at byte {}", path_, entry.offset));
  if (const uint64_t hash = opacityHash(transfer_); hash != metadata_.opacityHash) {
    throw mismatch(path_, entry.offset, "hash of the transfer function", fmt::format("{:016x}", metadata_.opacityHash),
                   fmt::format("{:016x}", hash));
  }
}

void AttenuationFile::readDirections() {
  const SectionEntry& entry = required(section::kDirections);
  constexpr uint64_t kBytes = 3 * shared::kDirectionCount;
  if (entry.items != shared::kDirectionCount || entry.bytes != kBytes) {
    throw mismatch(path_, entry.offset, "directions", fmt::format("26 items in {} bytes", kBytes),
                   fmt::format("{} in {}", entry.items, entry.bytes));
  }
  verifySection(entry);
  for (int k = 0; k < shared::kDirectionCount; ++k) {
    const uint64_t at = entry.offset + 3 * uint64_t(k);
    const glm::ivec3 expected(shared::directionX(k), shared::directionY(k), shared::directionZ(k));
    const glm::ivec3 found(copyAt<int8_t>(map_.bytes(), at), copyAt<int8_t>(map_.bytes(), at + 1),
                           copyAt<int8_t>(map_.bytes(), at + 2));
    if (found != expected) {
      throw mismatch(path_, at, fmt::format("direction {}", k),
                     fmt::format("{} {} {}", expected.x, expected.y, expected.z),
                     fmt::format("{} {} {}", found.x, found.y, found.z));
    }
  }
}

void AttenuationFile::checkBrickSection(SectionType type, uint64_t bytesPerBrick) const {
  const SectionEntry& entry = required(type);
  const auto expected = checkedProduct(entry.items, bytesPerBrick);
  if (entry.items != required(section::kBricks).items || expected != entry.bytes) {
    throw mismatch(path_, entry.offset, fmt::format("section {}", text(type)),
                   fmt::format("{} bricks of {} bytes", required(section::kBricks).items, bytesPerBrick),
                   fmt::format("{} in {} bytes", entry.items, entry.bytes));
  }
}

void AttenuationFile::readBricks() {
  const SectionEntry& entry = required(section::kBricks);
  if (checkedProduct(entry.items, sizeof(BrickEntry)) != entry.bytes) {
    throw mismatch(path_, entry.offset, "brick directory", fmt::format("{} bytes an item", sizeof(BrickEntry)),
                   fmt::format("{} items in {} bytes", entry.items, entry.bytes));
  }
  if (layout() == Layout::dense) {
    for (size_t which = 0; which < kDenseBricks.size(); ++which)
      checkBrickSection(kDenseBricks[which], denseBytes(which));
  }
  verifySection(entry);
  bricks_ = copyOf<BrickEntry>(content(entry));
  for (size_t which = 0; which < brickData_.size(); ++which)
    brickData_[which] = content(required(brickSections()[which]));
  if (layout() == Layout::compact) readFrames();

  curveOrder_ = brickCurveOrder(dims(), brickEdge());
  const uint64_t end = uint64_t(1) << (3 * curveOrder_);
  uint64_t next = 0, stored = 0, visible = 0;
  for (size_t i = 0; i < bricks_.size(); ++i) {
    const BrickEntry& brick = bricks_[i];
    const uint64_t at = entry.offset + i * sizeof(BrickEntry);
    if (brick.hilbertIndex < next || brick.hilbertIndex >= end) {
      throw mismatch(path_, at, fmt::format("Hilbert index of brick {}", i), fmt::format("{} to {}", next, end - 1),
                     brick.hilbertIndex);
    }
    const glm::ivec3 position = hilbertPosition(brick.hilbertIndex, curveOrder_);
    if (glm::any(glm::greaterThanEqual(position, brickDims(dims(), brickEdge())))) {
      throw mismatch(path_, at, fmt::format("position of brick {}", i), "one inside the volume",
                     fmt::format("{} {} {}", position.x, position.y, position.z));
    }
    const uint64_t inside = voxelCount(brickExtent(position, dims(), brickEdge()));
    if (brick.visibleVoxels > inside) {
      throw mismatch(path_, at + offsetof(BrickEntry, visibleVoxels), fmt::format("visible voxels of brick {}", i),
                     fmt::format("at most {}", inside), brick.visibleVoxels);
    }
    if (brick.zero != 0) throw mismatch(path_, at + offsetof(BrickEntry, zero), "reserved field", 0, brick.zero);
    next = brick.hilbertIndex + 1;
    stored += inside;
    visible += brick.visibleVoxels;
  }
  const uint64_t metadataOffset = required(section::kMetadata).offset;
  if (metadata_.storedVoxels != stored) {
    throw mismatch(path_, metadataOffset + offsetof(Metadata, storedVoxels), "stored voxels", stored,
                   metadata_.storedVoxels);
  }
  if (metadata_.visibleVoxels != visible) {
    throw mismatch(path_, metadataOffset + offsetof(Metadata, visibleVoxels), "visible voxels", visible,
                   metadata_.visibleVoxels);
  }
}

void AttenuationFile::readPins() {
  if (find(section::kPins) == nullptr && find(section::kPinFrames) == nullptr && find(section::kPackedPins) == nullptr)
    return;
  PinSections sections;
  const auto take = [&](SectionType type, PinSections::Section& to) {
    const SectionEntry& entry = required(type);
    to = {content(entry), entry.offset, entry.items};
    // As of other brick data, the frames' checksum is for verify().
    if (type != section::kPackedPins) verifySection(entry);
  };
  take(section::kPins, sections.pins);
  take(section::kPinFrames, sections.directory);
  take(section::kPackedPins, sections.frames);
  pinned_ = PinnedPlanes(path_, sections, dims(), brickEdge());
}

void AttenuationFile::readFrames() {
  const SectionEntry& entry = required(section::kFrames);
  checkBrickSection(section::kFrames, sizeof(FrameEntry));
  verifySection(entry);
  frames_ = copyOf<FrameEntry>(content(entry));
  for (size_t i = 0; i < frames_.size(); ++i) {
    if (frames_[i].zero != 0) {
      throw mismatch(path_, entry.offset + i * sizeof(FrameEntry) + offsetof(FrameEntry, zero), "reserved field", 0,
                     frames_[i].zero);
    }
  }
  for (size_t which = 0; which < brickData_.size(); ++which)
    checkFrames(which);
  regeneration_ = std::make_unique<const BrickRegeneration>(classification(), transfer_, coding_);
}

void AttenuationFile::checkFrames(size_t which) const {
  checkFrameList(
      path_, required(brickSections()[which]), frames_.size(), required(section::kFrames).offset, sizeof(FrameEntry),
      [&](size_t i) { return std::pair(frames_[i].offset[which], frames_[i].bytes[which]); },
      offsetof(FrameEntry, offset) + which * sizeof(uint64_t), offsetof(FrameEntry, bytes) + which * sizeof(uint32_t));
}

std::array<SectionType, 3> AttenuationFile::brickSections() const {
  return layout() == Layout::dense ? kDenseBricks : kCompactBricks;
}

uint64_t AttenuationFile::storedOffset(size_t which, size_t i) const {
  return layout() == Layout::dense ? i * denseBytes(which) : frames_[i].offset[which];
}

std::span<const std::byte> AttenuationFile::stored(size_t which, size_t i) const {
  const uint64_t bytes = layout() == Layout::dense ? denseBytes(which) : frames_[i].bytes[which];
  return brickData_[which].subspan(size_t(storedOffset(which, i)), size_t(bytes));
}

uint64_t AttenuationFile::codeBytes() const {
  return brickData_[0].size();
}

uint64_t AttenuationFile::attenuationBytes() const {
  return brickData_[1].size() + brickData_[2].size();
}

std::string AttenuationFile::command() const {
  const SectionEntry* entry = find(section::kCommand);
  if (entry == nullptr) return {};
  const auto bytes = content(*entry);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

uint64_t AttenuationFile::brickVoxels() const {
  return uint64_t(metadata_.brickEdge) * metadata_.brickEdge * metadata_.brickEdge;
}

glm::ivec3 AttenuationFile::brickOrigin(size_t i) const {
  check(i < bricks_.size(), "brick number is in range");
  return hilbertPosition(bricks_[i].hilbertIndex, curveOrder_) * brickEdge();
}

BrickView AttenuationFile::brick(size_t i, DirectionSet directions) const {
  check(i < bricks_.size(), "brick number is in range");
  const BrickEntry& entry = bricks_[i];
  const glm::ivec3 position = hilbertPosition(entry.hilbertIndex, curveOrder_);
  const int state = hilbertState(position, curveOrder_);
  const int brickOrder = std::countr_zero(metadata_.brickEdge);
  BrickView view;
  view.hilbertIndex = entry.hilbertIndex;
  view.origin = position * brickEdge();
  view.edge = brickEdge();
  view.visibleVoxels = entry.visibleVoxels;
  view.curve = hilbertCurve(state, brickOrder);
  view.steps = hilbertSteps(state, brickOrder);
  view.bytesPerCode = coding_.bytes();
  if (layout() == Layout::dense) {
    viewMap(view, i);
  } else {
    unpack(view, i, directions);
  }
  return view;
}

void AttenuationFile::viewMap(BrickView& view, size_t i) const {
  view.codes = stored(0, i).data();
  for (size_t k = 0; k < shared::kDirectionCount; ++k) {
    const auto* planes = reinterpret_cast<const uint8_t*>(stored(1 + k / kDirectionsPerSection, i).data());
    view.attenuations[k] = planes + k % kDirectionsPerSection * brickVoxels();
  }
}

void AttenuationFile::unpack(BrickView& view, size_t i, DirectionSet directions) const {
  const auto expectSound = [&](const std::optional<std::string>& problem, size_t which) {
    if (!problem) return;
    const SectionEntry& section = required(brickSections()[which]);
    throw InputError(fmt::format("{}: at byte {}: brick {} in section {}: {}", path_,
                                 section.offset + storedOffset(which, i), i, text(section.type), *problem));
  };
  const size_t codeBytes = size_t(denseBytes(0));
  const size_t planes = size_t(std::popcount(directions & kAllDirections));
  view.unpacked = std::make_unique_for_overwrite<std::byte[]>(codeBytes + planes * size_t(brickVoxels()));
  const std::span<std::byte> codes(view.unpacked.get(), codeBytes);
  view.codes = codes.data();
  expectSound(unpackCodes(stored(0, i), view.bytesPerCode, codes), 0);
  if (const uint32_t largest = largestCode(codes, view.bytesPerCode); largest > coding_.largest) {
    expectSound(fmt::format("expected codes up to {}, found {}", coding_.largest, largest), 0);
  }
  if ((directions & kAllDirections) == 0) return;

  BrickRegeneration::Brick brick;
  brick.codes = codes;
  brick.bytesPerCode = view.bytesPerCode;
  brick.hilbertState = hilbertState(view.origin / view.edge, curveOrder_);
  brick.edge = view.edge;
  brick.extent = brickExtent(view.origin / view.edge, dims(), view.edge);
  std::array<uint8_t*, shared::kDirectionCount> targets{};
  std::vector<uint8_t> faces;
  auto* plane = reinterpret_cast<uint8_t*>(view.unpacked.get()) + codeBytes;
  faces.resize(2 * passFaceBytes(view.edge));
  for (int pass = 0; pass < 2; ++pass) {
    constexpr DirectionSet kOfPass = (DirectionSet(1) << kDirectionsPerSection) - 1;
    if ((directions >> (pass * kDirectionsPerSection) & kOfPass) == 0) continue;
    const auto ofPass = std::span(faces).subspan(size_t(pass) * faces.size() / 2, faces.size() / 2);
    expectSound(unpackFaces(stored(size_t(pass) + 1, i), pass, view.edge, ofPass), size_t(pass) + 1);
    size_t at = 0;
    for (int k = pass * kDirectionsPerSection; k < (pass + 1) * kDirectionsPerSection; ++k) {
      brick.faces[size_t(k)] = ofPass.data() + at;
      at += DirectionFaces(k, view.edge).bytes();
      if ((directions >> k & 1) == 0) continue;
      view.attenuations[k] = targets[size_t(k)] = plane;
      plane += brickVoxels();
    }
  }
  regeneration_->regenerate(brick, directions, targets);
}

std::optional<size_t> AttenuationFile::findBrick(glm::ivec3 brickPosition) const {
  if (glm::any(glm::lessThan(brickPosition, glm::ivec3(0))) ||
      glm::any(glm::greaterThanEqual(brickPosition, brickDims(dims(), brickEdge())))) {
    return std::nullopt;
  }
  const uint64_t index = hilbertIndex(brickPosition, curveOrder_);
  const auto found =
      std::lower_bound(bricks_.begin(), bricks_.end(), index,
                       [](const BrickEntry& entry, uint64_t value) { return entry.hilbertIndex < value; });
  if (found == bricks_.end() || found->hilbertIndex != index) return std::nullopt;
  return size_t(found - bricks_.begin());
}

void AttenuationFile::verifyHash(const SectionEntry& entry, uint64_t hash) const {
  if (hash != entry.hash) {
    throw mismatch(path_, entry.offset, fmt::format("checksum of section {}", quoted(entry.type)),
                   fmt::format("{:016x}", entry.hash), fmt::format("{:016x}", hash));
  }
}

void AttenuationFile::verifySection(const SectionEntry& entry) const {
  verifyHash(entry, contentHash(content(entry)));
}

void AttenuationFile::verify() const {
  const auto bytes = map_.bytes();
  uint64_t end = sizeof(FileHeader) + sections_.size() * sizeof(SectionEntry);
  for (const SectionEntry& entry : sections_) {
    for (uint64_t at = end; at < entry.offset; ++at) {
      if (bytes[size_t(at)] != std::byte{0}) {
        throw mismatch(path_, at, "padding", 0, std::to_integer<int>(bytes[size_t(at)]));
      }
    }
    if (!holdsBrickData(entry.type)) verifySection(entry);
    end = entry.offset + entry.bytes;
  }
  for (size_t which = 0; which < kBrickHashes.size(); ++which)
    verifyHash(required(brickSections()[which]), brickSectionHash(bricks_, kBrickHashes[which]));
  for (size_t i = 0; i < bricks_.size(); ++i)
    verifyBrick(i);
  pinned_.verify();
  verifyLevels();
  checkIntact();
}

void AttenuationFile::verifyBrick(size_t i) const {
  check(i < bricks_.size(), "brick number is in range");
  for (size_t which = 0; which < kBrickHashes.size(); ++which) {
    const uint64_t expected = bricks_[i].*kBrickHashes[which];
    if (const uint64_t hash = contentHash(stored(which, i)); hash != expected) {
      const SectionEntry& section = required(brickSections()[which]);
      throw mismatch(path_, section.offset + storedOffset(which, i),
                     fmt::format("checksum of brick {} in section {}", i, text(section.type)),
                     fmt::format("{:016x}", expected), fmt::format("{:016x}", hash));
    }
  }
  // Frames with the right checksum can still be no frames.
  if (layout() == Layout::compact) brick(i);
}

}  // namespace freevoxel
