#include "precompute/precompute.h"

#include <omp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/grid.h"
#include "precompute/brick_faces.h"
#include "precompute/brick_store.h"
#include "precompute/brick_writer.h"
#include "precompute/checksums.h"
#include "precompute/code_spool.h"
#include "precompute/level_builder.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
#include "volume/code_visibility.h"
#include "volume/value_codes.h"

namespace freevoxel {

namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

uint64_t alignedUp(uint64_t offset, uint64_t alignment) {
  return (offset + alignment - 1) / alignment * alignment;
}

void checkOptions(const PrecomputeOptions& options, const std::string& path) {
  if (!validBrickEdge(options.brickEdge)) {
    throw InputError(fmt::format("{}: expected a brick edge of 8, 16 or 32 voxels, found {}", path, options.brickEdge));
  }
  if (options.levels < 0)
    throw InputError(fmt::format("{}: expected 0 or more levels, found {}", path, options.levels));
}

int levelsOf(const PrecomputeOptions& options, glm::ivec3 dims) {
  const int most = mostHierarchyLevels(dims, options.brickEdge);
  return options.levels == 0 ? most : std::min(options.levels, most);
}

LevelBuilder::Shape levelShape(const VolumeHeader& header, const PrecomputeOptions& options) {
  LevelBuilder::Shape shape;
  shape.dims = header.dims;
  shape.edges = glm::vec3(header.placement.spacing / header.placement.unitLength());
  shape.brickEdge = options.brickEdge;
  shape.levels = levelsOf(options, header.dims);
  shape.hierarchy = options.hierarchy;
  return shape;
}

/// Where every section will lie. Hashes are filled in as the sections are written.
class SectionPlan {
 public:
  void add(SectionType type, uint64_t items, uint64_t bytes, uint64_t alignment, uint32_t flags = 0) {
    sections_.push_back({type, flags, 0, bytes, items, 0});
    alignments_.push_back(alignment);
  }

  /// Call when all are added, and again when one has changed its size.
  void place() {
    uint64_t end = sizeof(FileHeader) + sections_.size() * sizeof(SectionEntry);
    for (size_t i = 0; i < sections_.size(); ++i) {
      sections_[i].offset = alignedUp(end, alignments_[i]);
      end = sections_[i].offset + sections_[i].bytes;
    }
    fileBytes_ = end;
  }

  uint64_t fileBytes() const { return fileBytes_; }
  std::span<const SectionEntry> sections() const { return sections_; }

  SectionEntry& operator[](SectionType type) {
    const auto found = std::find_if(sections_.begin(), sections_.end(), [&](const auto& s) { return s.type == type; });
    check(found != sections_.end(), "section is planned");
    return *found;
  }

 private:
  std::vector<SectionEntry> sections_;
  std::vector<uint64_t> alignments_;
  uint64_t fileBytes_ = 0;
};

/// What has to be known of a volume before the file can be planned.
struct Survey {
  ValueCoding coding;
  std::vector<StoredBrick> bricks;  ///< in file order
  uint64_t nonFinite = 0;
  double largestValueError = 0.0;
};

double largestCodingError(const Volume& volume, std::span<const uint16_t> codes, const ValueCoding& coding,
                          const TransferFunction& transfer) {
  return withValues(volume, [&](const auto* values) {
    double largest = 0.0;
#pragma omp parallel for reduction(max : largest)
    for (size_t i = 0; i < codes.size(); ++i) {
      const auto value = double(values[i]);
      if (value >= transfer.low && value <= transfer.high) {
        largest = std::max(largest, std::abs(coding.decode(codes[i]) - value));
      }
    }
    return largest;
  });
}

/// The sections that hold bricks: of codes, of directions 0..12 and of 13..25.
constexpr std::array<SectionType, 3> brickSections(Layout layout) {
  if (layout == Layout::dense) return {section::kCodes, section::kBackward, section::kForward};
  return {section::kPackedCodes, section::kPackedBackward, section::kPackedForward};
}

/// Frames are planned with the largest size they can have.
SectionPlan planSections(const PrecomputeOptions& options, const ValueCoding& coding, uint64_t bricks,
                         const std::string& transferText, int levels = 1, uint64_t levelBricks = 0) {
  const uint64_t brickVoxels = uint64_t(options.brickEdge) * uint64_t(options.brickEdge) * uint64_t(options.brickEdge);
  const uint64_t codeBytes = brickVoxels * uint64_t(coding.bytes());
  SectionPlan plan;
  plan.add(section::kMetadata, 1, sizeof(Metadata), kSectionAlignment);
  plan.add(section::kTransfer, transferText.size(), transferText.size(), kSectionAlignment);
  plan.add(section::kDirections, shared::kDirectionCount, 3 * shared::kDirectionCount, kSectionAlignment);
  plan.add(section::kCommand, options.command.size(), options.command.size(), kSectionAlignment, kSectionOptional);
  plan.add(section::kBricks, bricks, bricks * sizeof(BrickEntry), kSectionAlignment);
  if (levels > 1) plan.add(section::kLevels, levelBricks, levelBricks * sizeof(LevelEntry), kSectionAlignment);
  const auto [codes, backward, forward] = brickSections(options.layout);
  if (options.layout == Layout::dense) {
    plan.add(codes, bricks, bricks * codeBytes, kPageBytes);
    plan.add(backward, bricks, bricks * brickVoxels * kDirectionsPerSection, kPageBytes);
    plan.add(forward, bricks, bricks * brickVoxels * kDirectionsPerSection, kPageBytes);
  } else {
    const uint64_t faceBytes = largestFrame(passFaceBytes(options.brickEdge));
    plan.add(section::kFrames, bricks, bricks * sizeof(FrameEntry), kSectionAlignment);
    plan.add(codes, bricks, bricks * largestFrame(codeBytes), kSectionAlignment);
    plan.add(backward, bricks, bricks * faceBytes, kSectionAlignment);
    plan.add(forward, bricks, bricks * faceBytes, kSectionAlignment);
  }
  if (levels > 1) {
    const uint64_t attenuationBytes = LevelBuilder::largestAttenuation(levelBricks, options.brickEdge);
    plan.add(section::kLevelMatter, levelBricks, LevelBuilder::largestMatter(levelBricks, options.brickEdge),
             kSectionAlignment);
    plan.add(section::kLevelBackward, levelBricks, attenuationBytes, kSectionAlignment);
    plan.add(section::kLevelForward, levelBricks, attenuationBytes, kSectionAlignment);
  }
  plan.place();
  return plan;
}

Metadata describe(const VolumeHeader& header, const TransferFunction& transfer, const PrecomputeOptions& options,
                  const ValueCoding& coding, const PrecomputeResult& result) {
  Metadata metadata{};
  for (int axis = 0; axis < 3; ++axis) {
    metadata.dims[axis] = header.dims[axis];
    metadata.spacing[axis] = header.placement.spacing[axis];
    metadata.origin[axis] = header.placement.origin[axis];
    for (int row = 0; row < 3; ++row)
      metadata.direction[axis * 3 + row] = header.placement.direction[axis][row];
  }
  metadata.brickEdge = uint32_t(options.brickEdge);
  metadata.codeLow = coding.low;
  metadata.codeStep = coding.step;
  metadata.codeLargest = coding.largest;
  metadata.codeBytes = uint32_t(coding.bytes());
  metadata.classification = options.classification;
  metadata.layout = options.layout;
  metadata.levels = uint32_t(result.levels);
  metadata.hierarchy = result.levels > 1 ? options.hierarchy : Hierarchy::geometric;
  metadata.voxels = result.voxels;
  metadata.storedVoxels = result.storedVoxels;
  metadata.visibleVoxels = result.visibleVoxels;
  metadata.nonFinite = result.nonFinite;
  metadata.opacityHash = opacityHash(transfer);
  metadata.largestValueError = result.largestValueError;
  return metadata;
}

std::vector<int8_t> directionTable() {
  std::vector<int8_t> table;
  for (int k = 0; k < shared::kDirectionCount; ++k) {
    for (const int step : {shared::directionX(k), shared::directionY(k), shared::directionZ(k)}) {
      table.push_back(int8_t(step));
    }
  }
  return table;
}

/// Which passes run together, one set of bits after the other (sweepAttenuation).
using PassPlan = std::vector<unsigned>;

/// Sweeps, and gives `store` all bricks. Adds its figures to `result`.
void fillStore(BrickStore& store, const VolumeHeader& header, const TransferFunction& transfer, CodePlanes& codes,
               const Survey& survey, const PassPlan& passPlan, const PrecomputeOptions& options, LevelBuilder* levels,
               Progress& progress, PrecomputeResult& result) {
  BrickWriter writer(store, survey.bricks, header.dims, options.brickEdge,
                     [&](uint64_t voxels) { progress.advance(voxels); });
  for (int slab = 0; slab < brickDims(header.dims, options.brickEdge).z; ++slab) {
    const int first = slab * options.brickEdge;
    const int count = std::min(options.brickEdge, header.dims.z - first);
    writer.writeCodes(slab, codes.planes(0, first, count), survey.coding);
    if (levels == nullptr) continue;
    const PlaneRange around = planesOfSlab(header.dims, options.brickEdge, slab);
    levels->addCodes(slab, codes.planes(0, around.first, around.last - around.first));
  }
  if (levels != nullptr) writer.buildLevels(*levels, codes);
  const auto segments = makeSegmentDepth(options.classification, transfer, survey.coding);
  progress.begin("attenuation", header.voxels() * shared::kDirectionCount, "voxels");
  const auto sweepStart = Clock::now();
  for (const unsigned passes : passPlan)
    sweepAttenuation(codes, header.dims, options.brickEdge, *segments, writer, passes);
  result.sweepSeconds = secondsSince(sweepStart) - writer.writeSeconds();
  progress.end();
}

/// Gives a section of frames the size it has become and moves it down to where the one before it ends.
void closeGap(AtomicFile& file, SectionType type, uint64_t writtenAt, uint64_t bytes, SectionPlan& plan) {
  plan[type].bytes = bytes;
  plan.place();
  const uint64_t end = plan[type].offset + bytes;
  file.moveDown(writtenAt, plan[type].offset, bytes);
  // What lay there before must not show between the sections.
  file.writeAt(end, std::vector<std::byte>(alignedUp(end, kSectionAlignment) - end));
}

constexpr std::array<SectionType, 3> kLevelSections = {section::kLevelMatter, section::kLevelBackward,
                                                       section::kLevelForward};

/// All sections but those of bricks, then the header, then the name. Adds to `result`. `frames`: of layout compact.
void finishFile(AtomicFile& file, const VolumeHeader& header, const TransferFunction& transfer,
                const PrecomputeOptions& options, const ValueCoding& coding, std::span<const BrickEntry> entries,
                std::span<const FrameEntry> frames, std::span<const LevelEntry> levels, SectionPlan& plan,
                PrecomputeResult& result) {
  const auto [codesType, backwardType, forwardType] = brickSections(options.layout);
  const std::string transferText = transferFunctionJson(transfer);
  const auto writeSection = [&](SectionType type, std::span<const std::byte> bytes) {
    checkEqual(uint64_t(bytes.size()), plan[type].bytes, "bytes of a section");
    plan[type].hash = contentHash(bytes);
    file.writeAt(plan[type].offset, bytes);
  };
  const std::vector<int8_t> directions = directionTable();
  const Metadata metadata = describe(header, transfer, options, coding, result);
  writeSection(section::kMetadata, std::as_bytes(std::span(&metadata, 1)));
  writeSection(section::kTransfer, std::as_bytes(std::span(transferText)));
  writeSection(section::kDirections, std::as_bytes(std::span(directions)));
  writeSection(section::kCommand, std::as_bytes(std::span(options.command)));
  writeSection(section::kBricks, std::as_bytes(entries));
  if (options.layout == Layout::compact) writeSection(section::kFrames, std::as_bytes(frames));
  if (result.levels > 1) {
    writeSection(section::kLevels, std::as_bytes(levels));
    for (size_t which = 0; which < kLevelSections.size(); ++which)
      plan[kLevelSections[which]].hash = levelSectionHash(levels, which);
  }
  plan[codesType].hash = brickSectionHash(entries, &BrickEntry::codesHash);
  plan[backwardType].hash = brickSectionHash(entries, &BrickEntry::backwardHash);
  plan[forwardType].hash = brickSectionHash(entries, &BrickEntry::forwardHash);

  // The header comes last, when all else is on the disk: without it nothing takes the file for an attenuation file.
  file.sync();
  FileHeader fileHeader{kFileMagic, kFileVersion, uint32_t(plan.sections().size()), plan.fileBytes(), 0};
  fileHeader.hash = headerHash(fileHeader, plan.sections());
  file.writeAt(sizeof(FileHeader), std::as_bytes(plan.sections()));
  file.writeAt(0, std::as_bytes(std::span(&fileHeader, 1)));
  file.commit();
  result.fileBytes = plan.fileBytes();
}

/// The file proper, given all that is known before the sweep. Adds its figures to `result`.
void writeFile(const VolumeHeader& header, const TransferFunction& transfer, CodePlanes& codes, const Survey& survey,
               const PassPlan& passPlan, const std::string& path, const PrecomputeOptions& options, Progress& progress,
               PrecomputeResult& result) {
  const auto start = Clock::now();
  const std::string transferText = transferFunctionJson(transfer);
  const LevelBuilder::Shape shape = levelShape(header, options);
  result.levels = shape.levels;
  SectionPlan plan = planSections(options, survey.coding, survey.bricks.size(), transferText, shape.levels,
                                  LevelBuilder::brickCount(survey.bricks, shape.levels));
  const auto [codesType, backwardType, forwardType] = brickSections(options.layout);
  AtomicFile file(path);
  std::unique_ptr<BrickStore> store;
  const CompactStore* compact = nullptr;
  if (options.layout == Layout::dense) {
    file.reserve(plan[forwardType].offset + plan[forwardType].bytes);
    store = std::make_unique<DenseStore>(
        file, DenseStore::Offsets{plan[codesType].offset, plan[backwardType].offset, plan[forwardType].offset},
        survey.bricks, options.brickEdge, survey.coding.bytes());
  } else {
    auto made = std::make_unique<CompactStore>(
        file, std::array{plan[codesType].offset, plan[backwardType].offset, plan[forwardType].offset}, survey.bricks,
        header.dims, options.brickEdge, survey.coding.bytes());
    compact = made.get();
    store = std::move(made);
  }
  std::array<uint64_t, 3> levelOffsets{};
  std::unique_ptr<LevelBuilder> levels;
  if (shape.levels > 1) {
    for (size_t which = 0; which < kLevelSections.size(); ++which)
      levelOffsets[which] = plan[kLevelSections[which]].offset;
    levels = std::make_unique<LevelBuilder>(file, levelOffsets, shape, survey.bricks, transfer, survey.coding);
  }
  fillStore(*store, header, transfer, codes, survey, passPlan, options, levels.get(), progress, result);
  if (compact != nullptr) {
    const auto sections = brickSections(Layout::compact);
    for (size_t which = 0; which < sections.size(); ++which)
      closeGap(file, sections[which], compact->section(which).offset, compact->section(which).bytes, plan);
  }
  if (levels) {
    for (size_t which = 0; which < kLevelSections.size(); ++which) {
      closeGap(file, kLevelSections[which], levelOffsets[which], levels->sectionBytes(which), plan);
      result.levelBytes += levels->sectionBytes(which);
    }
  }
  file.truncate(plan.fileBytes());

  finishFile(file, header, transfer, options, survey.coding, store->entries(),
             compact != nullptr ? compact->frames() : std::span<const FrameEntry>(),
             levels ? levels->entries() : std::span<const LevelEntry>(), plan, result);
  result.writeSeconds = secondsSince(start) - result.sweepSeconds;
}

PrecomputeResult resultOf(const VolumeHeader& header, const Survey& survey, int edge) {
  PrecomputeResult result;
  result.voxels = header.voxels();
  result.bricks = survey.bricks.size();
  for (const StoredBrick& brick : survey.bricks) {
    result.storedVoxels += voxelCount(brickExtent(brick.position, header.dims, edge));
    result.visibleVoxels += brick.visibleVoxels;
  }
  result.nonFinite = survey.nonFinite;
  result.largestValueError = survey.largestValueError;
  return result;
}

PrecomputeResult precomputeChecked(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                                   const PrecomputeOptions& options, Progress& progress) {
  const glm::ivec3 dims = volume.header.dims;
  Survey survey;
  survey.coding = valueCoding(volume.header.type, transfer.low, transfer.high);
  const std::vector<uint16_t> codes = encodeValues(volume, survey.coding);
  survey.bricks = findStoredBricks(codes, dims, options.brickEdge, transfer, survey.coding);
  survey.nonFinite = valueStatistics(volume).nonFinite;
  survey.largestValueError = largestCodingError(volume, codes, survey.coding, transfer);
  PrecomputeResult result = resultOf(volume.header, survey, options.brickEdge);
  StoredCodePlanes planes(codes, dims);
  writeFile(volume.header, transfer, planes, survey, {3u}, path, options, progress, result);
  return result;
}

/// Bytes held while the volume is read: the slice and its codes, the codes of a slab and its neighbours, the ranges
/// that findStoredBricks makes of them.
uint64_t surveyBytes(const VolumeHeader& header, int edge) {
  const uint64_t planeVoxels = uint64_t(header.dims.x) * uint64_t(header.dims.y);
  return planeVoxels * (bytesPerValue(header.type) + 2 + 2 * (uint64_t(edge) + 2) + 12);
}

/// Bytes held while so many passes run at once. `bricks`: of the volume, and of its largest slab, stored.
uint64_t passBytes(const VolumeHeader& header, const PrecomputeOptions& options, int passCount, uint64_t bricks,
                   uint64_t slabBricks) {
  const int edge = options.brickEdge;
  const uint64_t planeVoxels = uint64_t(header.dims.x) * uint64_t(header.dims.y);
  const uint64_t brickVoxels = uint64_t(edge) * uint64_t(edge) * uint64_t(edge);
  const uint64_t window = planeVoxels * 2 * (uint64_t(edge) + 1);
  constexpr uint64_t kBytesPerBrick = 2 * (sizeof(StoredBrick) + sizeof(BrickEntry) + 32);  // lists that grow
  // A slab's frames wait until all of them are packed, each in room for the largest, and are then joined.
  const uint64_t frames = options.layout == Layout::compact
                              ? bricks * sizeof(FrameEntry) + 2 * slabBricks * largestFrame(passFaceBytes(edge))
                              : 0;
  const LevelBuilder::Shape shape = levelShape(header, options);
  // A brick of level 1 stands for up to eight.
  const uint64_t levels =
      shape.levels > 1 ? LevelBuilder::memoryBytes(shape, passCount) + bricks * (sizeof(LevelEntry) + 64) +
                             uint64_t(passCount) * 2 * planeVoxels  // levels take planes to either side of a slab
                       : 0;
  return bricks * kBytesPerBrick + frames + levels +
         uint64_t(passCount) * (window + slabBricks * kDirectionsPerSection * brickVoxels) +
         sweepBytes(header.dims, edge, passCount, omp_get_max_threads());
}

[[noreturn]] void failForMemory(const std::string& path, uint64_t needed, const PrecomputeOptions& options) {
  throw MachineError(fmt::format(
      "{}: bricks of {} voxels an edge need {} bytes of memory for this volume, {} are allowed; try more{}{}", path,
      options.brickEdge, needed, options.memoryBytes, options.brickEdge > 8 ? ", or smaller bricks" : "",
      options.levels != 1 ? ", or --levels 1" : ""));
}

/// Reads the volume once: its codes into `spool`, its figures into the result.
Survey surveySource(VolumeSource& source, const TransferFunction& transfer, int edge, CodeSpool& spool,
                    const ValueCoding& coding, Progress& progress) {
  const VolumeHeader& header = source.header();
  const glm::ivec3 dims = header.dims;
  const size_t planeVoxels = size_t(dims.x) * size_t(dims.y);
  const CodeVisibility visibility(transfer, coding);
  Survey survey;
  survey.coding = coding;
  Volume slice;
  slice.header = header;
  slice.header.dims.z = 1;
  slice.data.resize(slice.header.bytes());
  std::vector<uint16_t> window(planeVoxels * (size_t(edge) + 2));
  int windowFirst = 0, read = 0;
  progress.begin("reading", header.voxels(), "voxels");
  for (int slab = 0; slab < brickDims(dims, edge).z; ++slab) {
    const PlaneRange planes = planesOfSlab(dims, edge, slab);
    const size_t kept = size_t(read - planes.first) * planeVoxels;
    const auto from = window.begin() + ptrdiff_t(size_t(planes.first - windowFirst) * planeVoxels);
    std::copy(from, from + ptrdiff_t(kept), window.begin());
    windowFirst = planes.first;
    for (; read < planes.last; ++read) {
      source.readSlices(1, slice.data);
      const std::vector<uint16_t> codes = encodeValues(slice, coding);
      survey.nonFinite += valueStatistics(slice).nonFinite;
      survey.largestValueError = std::max(survey.largestValueError, largestCodingError(slice, codes, coding, transfer));
      spool.append(codes);
      std::copy(codes.begin(), codes.end(), window.begin() + ptrdiff_t(size_t(read - windowFirst) * planeVoxels));
      progress.advance(planeVoxels);
    }
    const auto used = std::span<const uint16_t>(window).first(size_t(planes.last - planes.first) * planeVoxels);
    const auto found = findStoredBricks(used, dims, edge, slab, visibility);
    survey.bricks.insert(survey.bricks.end(), found.begin(), found.end());
  }
  progress.end();
  sortAlongCurve(survey.bricks);
  return survey;
}

PrecomputeResult precomputeChecked(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                                   const PrecomputeOptions& options, Progress& progress) {
  const VolumeHeader header = source.header();
  const int edge = options.brickEdge;
  const auto allows = [&](uint64_t bytes) { return options.memoryBytes == 0 || bytes <= options.memoryBytes; };
  // What is known before anything is read.
  const uint64_t least = std::max(surveyBytes(header, edge), passBytes(header, options, 1, 0, 0));
  if (!allows(least)) failForMemory(path, least, options);

  const ValueCoding coding = valueCoding(header.type, transfer.low, transfer.high);
  CodeSpool spool(path, header.dims, coding.bytes());
  const Survey survey = surveySource(source, transfer, edge, spool, coding, progress);
  std::vector<uint64_t> slabBricks(size_t(brickDims(header.dims, edge).z));
  for (const StoredBrick& brick : survey.bricks)
    ++slabBricks[size_t(brick.position.z)];
  const uint64_t largestSlab = *std::max_element(slabBricks.begin(), slabBricks.end());
  const uint64_t single = passBytes(header, options, 1, survey.bricks.size(), largestSlab);
  if (!allows(single)) failForMemory(path, single, options);
  const bool together = allows(passBytes(header, options, 2, survey.bricks.size(), largestSlab));
  PrecomputeResult result = resultOf(header, survey, edge);
  writeFile(header, transfer, spool, survey, together ? PassPlan{3u} : PassPlan{1u, 2u}, path, options, progress,
            result);
  return result;
}

/// Codes of the planes that a rank needs, all in memory.
class KeptCodePlanes final : public CodePlanes {
 public:
  KeptCodePlanes(glm::ivec3 dims, PlaneRange range)
      : planeVoxels_(size_t(dims.x) * size_t(dims.y)),
        range_(range),
        codes_(size_t(range.last - range.first) * planeVoxels_) {}
  std::span<uint16_t> plane(int z) { return span(z, 1); }
  std::span<const uint16_t> planes(int /*pass*/, int first, int count) override { return span(first, count); }

 private:
  std::span<uint16_t> span(int first, int count) {
    check(first >= range_.first && first + count <= range_.last, "planes are this rank's");
    return std::span(codes_).subspan(size_t(first - range_.first) * planeVoxels_, size_t(count) * planeVoxels_);
  }
  size_t planeVoxels_;
  PlaneRange range_;
  std::vector<uint16_t> codes_;
};

/// Wants nothing.
class NoBricks final : public AttenuationSink {
 public:
  std::span<const BrickPlanes> begin(int /*pass*/, int /*slab*/) override { return {}; }
  void complete(int /*pass*/, int /*slab*/) override {}
};

/// The slabs of bricks of a rank, first..last-1. The last rank has the last slab.
struct SlabShare {
  int first, last;
  bool empty() const { return first == last; }
};
SlabShare slabsOfRank(int slabs, int rank, int rankCount) {
  return {int(int64_t(slabs) * rank / rankCount), int(int64_t(slabs) * (rank + 1) / rankCount)};
}

template <class T>
std::string bytesOf(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}
template <class T>
void appendFrom(const std::string& bytes, std::vector<T>& values) {
  const size_t before = values.size();
  values.resize(before + bytes.size() / sizeof(T));
  std::memcpy(values.data() + before, bytes.data(), (values.size() - before) * sizeof(T));
}

/// Reads a rank's planes and finds its bricks.
Survey surveyShare(VolumeSource& source, const TransferFunction& transfer, int edge, SlabShare share,
                   const ValueCoding& coding, KeptCodePlanes& planes, Progress& progress) {
  const VolumeHeader& header = source.header();
  const glm::ivec3 dims = header.dims;
  Survey survey;
  survey.coding = coding;
  if (share.empty()) return survey;
  const PlaneRange needed{planesOfSlab(dims, edge, share.first).first, planesOfSlab(dims, edge, share.last - 1).last};
  Volume slice;
  slice.header = header;
  slice.header.dims.z = 1;
  slice.data.resize(slice.header.bytes());
  progress.begin("reading", uint64_t(dims.x) * uint64_t(dims.y) * uint64_t(needed.last), "voxels");
  for (int z = 0; z < needed.last; ++z) {
    source.readSlices(1, slice.data);
    progress.advance(slice.header.voxels());
    if (z < needed.first) continue;
    const std::vector<uint16_t> codes = encodeValues(slice, coding);
    std::copy(codes.begin(), codes.end(), planes.plane(z).begin());
    if (z < share.first * edge || z >= share.last * edge) continue;
    survey.nonFinite += valueStatistics(slice).nonFinite;
    survey.largestValueError = std::max(survey.largestValueError, largestCodingError(slice, codes, coding, transfer));
  }
  progress.end();
  const CodeVisibility visibility(transfer, coding);
  for (int slab = share.first; slab < share.last; ++slab) {
    const PlaneRange range = planesOfSlab(dims, edge, slab);
    const auto found =
        findStoredBricks(planes.planes(0, range.first, range.last - range.first), dims, edge, slab, visibility);
    survey.bricks.insert(survey.bricks.end(), found.begin(), found.end());
  }
  return survey;
}

/// The survey of the whole volume.
Survey joinSurveys(const Survey& mine, SlabTeam& team) {
  struct Figures {
    uint64_t nonFinite;
    double largestValueError;
  } figures{mine.nonFinite, mine.largestValueError};
  std::vector<Figures> all;
  for (const std::string& bytes : team.gatherEverywhere(bytesOf(std::span<const Figures>(&figures, 1))))
    appendFrom(bytes, all);
  Survey joined;
  joined.coding = mine.coding;
  for (const Figures& of : all) {
    joined.nonFinite += of.nonFinite;
    joined.largestValueError = std::max(joined.largestValueError, of.largestValueError);
  }
  for (const std::string& bytes : team.gatherEverywhere(bytesOf(std::span<const StoredBrick>(mine.bricks))))
    appendFrom(bytes, joined.bricks);
  sortAlongCurve(joined.bricks);
  return joined;
}

/// Gives every rank the depths that come into its share: an exclusive prefix sum over the ranks along rays, which shift
/// from plane to plane; what enters by a side starts at 0. `leaving`: what each share takes by itself; used up.
BorderDepths passOnDepths(BorderDepths leaving, glm::ivec3 dims, int edge, SlabShare share, SlabTeam& team) {
  const int slabs = brickDims(dims, edge).z;
  const size_t planeVoxels = size_t(dims.x) * size_t(dims.y);
  const int planes = std::min(share.last * edge, dims.z) - share.first * edge;
  BorderDepths incoming;
  for (auto& depths : incoming)
    depths.resize(kBorderDirections * planeVoxels);
  team.agree();
  if (share.empty()) return incoming;
  for (int pass = 0; pass < kSweepPasses; ++pass) {
    // Ranks without slabs are passed over.
    const auto neighbour = [&](int step) {
      int rank = team.rank() + step;
      while (rank >= 0 && rank < team.rankCount() && slabsOfRank(slabs, rank, team.rankCount()).empty())
        rank += step;
      return rank >= 0 && rank < team.rankCount() ? rank : -1;
    };
    const int before = neighbour(pass == 0 ? -1 : 1), after = neighbour(pass == 0 ? 1 : -1);
    std::span<FixedDepth> in = incoming[size_t(pass)], out = leaving[size_t(pass)];
    if (before >= 0) team.receive(before, std::as_writable_bytes(in));
    if (after < 0) continue;
    for (size_t i = 0; before >= 0 && i < size_t(kBorderDirections); ++i) {
      addIncoming(in.subspan(i * planeVoxels, planeVoxels), borderDirection(pass, int(i)), planes, dims,
                  out.subspan(i * planeVoxels, planeVoxels));
    }
    team.send(after, std::as_bytes(out));
  }
  return incoming;
}

/// Bytes that a rank holds with its share: codes, depths at borders and, of layout compact, at worst all frames.
uint64_t shareBytes(const VolumeHeader& header, const PrecomputeOptions& options, SlabShare share) {
  const uint64_t planeVoxels = uint64_t(header.dims.x) * uint64_t(header.dims.y);
  const auto edge = uint64_t(options.brickEdge);
  const uint64_t slabs = uint64_t(share.last - share.first);
  return surveyBytes(header, 0) +
         planeVoxels * (2 * (slabs * edge + 2) + 2 * 2 * kBorderDirections * sizeof(FixedDepth) +
                        2 * edge * kDirectionsPerSection) +
         (options.layout == Layout::compact
              ? slabs * (planeVoxels / (edge * edge) + 1) * 2 * largestFrame(passFaceBytes(options.brickEdge))
              : 0) +
         sweepBytes(header.dims, options.brickEdge, kSweepPasses, omp_get_max_threads());
}

PrecomputeResult precomputeTogether(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                                    const PrecomputeOptions& options, SlabTeam& team, Progress& progress) {
  if (levelsOf(options, source.header().dims) > 1) {
    throw InputError(fmt::format("{}: levels of detail are made by one process; leave --levels out, or mpirun", path));
  }
  const auto start = Clock::now();
  const VolumeHeader header = source.header();
  const glm::ivec3 dims = header.dims;
  const int edge = options.brickEdge;
  const SlabShare share = slabsOfRank(brickDims(dims, edge).z, team.rank(), team.rankCount());
  const uint64_t needed = shareBytes(header, options, share);
  if (options.memoryBytes != 0 && needed > options.memoryBytes) failForMemory(path, needed, options);

  const ValueCoding coding = valueCoding(header.type, transfer.low, transfer.high);
  PlaneRange kept;
  if (!share.empty()) {
    kept = {planesOfSlab(dims, edge, share.first).first, planesOfSlab(dims, edge, share.last - 1).last};
  }
  KeptCodePlanes planes(dims, kept);
  const Survey mine = surveyShare(source, transfer, edge, share, coding, planes, progress);
  team.agree();
  const Survey survey = joinSurveys(mine, team);
  PrecomputeResult result = resultOf(header, survey, edge);

  const auto segments = makeSegmentDepth(options.classification, transfer, coding);
  const auto sweepStart = Clock::now();
  SweepPart part{share.first, share.last, {}, true};
  NoBricks nothing;
  part.incoming = passOnDepths(sweepPart(planes, dims, edge, *segments, nothing, 3u, part), dims, edge, share, team);
  part.bordersOnly = false;

  // Rank 0 makes the file, the others write into it.
  std::unique_ptr<AtomicFile> file;
  if (team.rank() == 0) file = std::make_unique<AtomicFile>(path);
  team.agree();
  const std::string temporary = team.gatherEverywhere(file ? file->temporaryPath() : "")[0];
  if (!file) file = std::make_unique<AtomicFile>(AtomicFile::join(path, temporary));
  SectionPlan plan = planSections(options, coding, survey.bricks.size(), transferFunctionJson(transfer));
  const auto sections = brickSections(options.layout);
  std::unique_ptr<BrickStore> store;
  KeptCompactStore* compact = nullptr;
  if (options.layout == Layout::dense) {
    if (team.rank() == 0) file->reserve(plan.fileBytes());
    store = std::make_unique<DenseStore>(
        *file, DenseStore::Offsets{plan[sections[0]].offset, plan[sections[1]].offset, plan[sections[2]].offset},
        survey.bricks, edge, coding.bytes());
  } else {
    auto made = std::make_unique<KeptCompactStore>(*file, survey.bricks, dims, edge, coding.bytes());
    compact = made.get();
    store = std::move(made);
  }
  team.agree();

  BrickWriter writer(*store, survey.bricks, dims, edge, [&](uint64_t voxels) { progress.advance(voxels); });
  for (int slab = share.first; slab < share.last; ++slab) {
    const int first = slab * edge;
    writer.writeCodes(slab, planes.planes(0, first, std::min(edge, dims.z - first)), coding);
  }
  const int ownPlanes = share.empty() ? 0 : std::min(share.last * edge, dims.z) - share.first * edge;
  progress.begin("attenuation", voxelCount({dims.x, dims.y, ownPlanes}) * shared::kDirectionCount, "voxels");
  sweepPart(planes, dims, edge, *segments, writer, 3u, part);
  progress.end();
  result.sweepSeconds = secondsSince(sweepStart) - writer.writeSeconds();
  team.agree();

  // Frames of codes and of backward faces come in the order of the ranks, those of forward faces in the opposite one.
  std::array<uint64_t, 3> offsets{};
  if (compact != nullptr) {
    std::array<uint64_t, 3> sizes{};
    for (size_t which = 0; which < sizes.size(); ++which)
      sizes[which] = compact->bytes(which).size();
    std::vector<std::array<uint64_t, 3>> all;
    for (const std::string& bytes : team.gatherEverywhere(bytesOf(std::span<const std::array<uint64_t, 3>>(&sizes, 1))))
      appendFrom(bytes, all);
    for (size_t which = 0; which < sizes.size(); ++which) {
      uint64_t total = 0;
      for (int rank = 0; rank < team.rankCount(); ++rank) {
        const uint64_t bytes = all[size_t(rank)][which];
        total += bytes;
        if (which == 2 ? rank > team.rank() : rank < team.rank()) offsets[which] += bytes;
      }
      plan[sections[which]].bytes = total;
    }
    plan.place();
    if (team.rank() == 0) file->reserve(plan.fileBytes());
    team.agree();
    for (size_t which = 0; which < sizes.size(); ++which)
      file->writeAt(plan[sections[which]].offset + offsets[which], compact->bytes(which));
  }
  // All must be on the disk before the header is.
  if (team.rank() != 0) file->sync();

  std::vector<BrickEntry> entries(store->entries().begin(), store->entries().end()), ownEntries;
  std::vector<FrameEntry> frames, ownFrames;
  if (compact != nullptr) frames.assign(compact->frames().begin(), compact->frames().end());
  const auto owns = [&](size_t brick, SlabShare slabs) {
    const int slab = survey.bricks[brick].position.z;
    return slab >= slabs.first && slab < slabs.last;
  };
  for (size_t brick = 0; brick < entries.size(); ++brick) {
    if (!owns(brick, share)) continue;
    ownEntries.push_back(entries[brick]);
    if (compact == nullptr) continue;
    ownFrames.push_back(frames[brick]);
    for (size_t which = 0; which < offsets.size(); ++which)
      ownFrames.back().offset[which] += offsets[which];
  }
  team.agree();
  const auto collect = [&](const auto& own, auto& all) {
    const std::vector<std::string> bytes = team.gatherEverywhere(bytesOf(std::span(own)));
    for (int rank = 0; rank < team.rankCount(); ++rank) {
      std::decay_t<decltype(all)> theirs;
      appendFrom(bytes[size_t(rank)], theirs);
      const SlabShare slabs = slabsOfRank(brickDims(dims, edge).z, rank, team.rankCount());
      size_t next = 0;
      for (size_t brick = 0; brick < all.size(); ++brick) {
        if (owns(brick, slabs)) all[brick] = theirs[next++];
      }
    }
  };
  collect(ownEntries, entries);
  if (compact != nullptr) collect(ownFrames, frames);
  if (team.rank() == 0) finishFile(*file, header, transfer, options, coding, entries, frames, {}, plan, result);
  team.agree();
  result.fileBytes = plan.fileBytes();
  result.writeSeconds = secondsSince(start) - result.sweepSeconds;
  return result;
}

/// Calls f; no memory becomes an error that says of what.
template <class F>
PrecomputeResult withMemoryErrors(const VolumeHeader& header, const std::string& path, F&& f) {
  try {
    return f();
  } catch (const std::bad_alloc&) {
    const glm::ivec3 dims = header.dims;
    throw MachineError(
        fmt::format("{}: not enough memory to precompute {} x {} x {} voxels; try --memory, a machine with more, or a "
                    "volume cropped or reduced",
                    path, dims.x, dims.y, dims.z));
  }
}

}  // namespace

PrecomputeResult precompute(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, Progress& progress) {
  checkOptions(options, path);
  check(validDims(volume.header.dims), "volume dims are valid");
  checkEqual(uint64_t(volume.data.size()), volume.header.bytes(), "bytes of the volume");
  volume.header.placement.check();
  return withMemoryErrors(volume.header, path,
                          [&] { return precomputeChecked(volume, transfer, path, options, progress); });
}

PrecomputeResult precompute(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, Progress& progress) {
  checkOptions(options, path);
  return withMemoryErrors(source.header(), path,
                          [&] { return precomputeChecked(source, transfer, path, options, progress); });
}

PrecomputeResult precompute(VolumeSource& source, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, SlabTeam& team, Progress& progress) {
  checkOptions(options, path);
  return withMemoryErrors(source.header(), path,
                          [&] { return precomputeTogether(source, transfer, path, options, team, progress); });
}

}  // namespace freevoxel
