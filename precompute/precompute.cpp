#include "precompute/precompute.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <span>
#include <vector>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/grid.h"
#include "precompute/brick_writer.h"
#include "precompute/checksums.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
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
  if (options.layout != Layout::dense) {
    throw InputError(
        fmt::format("{}: expected layout dense, found {}, which is not written yet", path, layoutName(options.layout)));
  }
}

/// Where every section will lie. Hashes are filled in as the sections are written.
class SectionPlan {
 public:
  void add(SectionType type, uint64_t items, uint64_t bytes, uint64_t alignment, uint32_t flags = 0) {
    sections_.push_back({type, flags, alignment, bytes, items, 0});
  }

  /// Call once, when all are added.
  void place() {
    uint64_t end = sizeof(FileHeader) + sections_.size() * sizeof(SectionEntry);
    for (SectionEntry& entry : sections_) {
      entry.offset = alignedUp(end, entry.offset);
      end = entry.offset + entry.bytes;
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
  std::vector<SectionEntry> sections_;  ///< until place(), `offset` holds the alignment
  uint64_t fileBytes_ = 0;
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

SectionPlan planSections(const PrecomputeOptions& options, const ValueCoding& coding, uint64_t bricks,
                         const std::string& transferText) {
  const uint64_t brickVoxels = uint64_t(options.brickEdge) * uint64_t(options.brickEdge) * uint64_t(options.brickEdge);
  const uint64_t attenuationBytes = bricks * brickVoxels * kDirectionsPerSection;
  SectionPlan plan;
  plan.add(section::kMetadata, 1, sizeof(Metadata), kSectionAlignment);
  plan.add(section::kTransfer, transferText.size(), transferText.size(), kSectionAlignment);
  plan.add(section::kDirections, shared::kDirectionCount, 3 * shared::kDirectionCount, kSectionAlignment);
  plan.add(section::kCommand, options.command.size(), options.command.size(), kSectionAlignment, kSectionOptional);
  plan.add(section::kBricks, bricks, bricks * sizeof(BrickEntry), kSectionAlignment);
  plan.add(section::kCodes, bricks, bricks * brickVoxels * uint64_t(coding.bytes()), kPageBytes);
  plan.add(section::kBackward, bricks, attenuationBytes, kPageBytes);
  plan.add(section::kForward, bricks, attenuationBytes, kPageBytes);
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
  metadata.levels = 1;
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

/// The file proper, given all that is known before the sweep. Adds its figures to `result`.
void writeFile(const Volume& volume, const TransferFunction& transfer, std::span<const uint16_t> codes,
               const ValueCoding& coding, std::span<const StoredBrick> bricks, const std::string& path,
               const PrecomputeOptions& options, Progress& progress, PrecomputeResult& result) {
  const auto start = Clock::now();
  const std::string transferText = transferFunctionJson(transfer);
  SectionPlan plan = planSections(options, coding, bricks.size(), transferText);
  AtomicFile file(path);
  file.reserve(plan.fileBytes());

  BrickWriter writer(file,
                     {plan[section::kCodes].offset, plan[section::kBackward].offset, plan[section::kForward].offset},
                     bricks, volume.header.dims, options.brickEdge, [&](uint64_t voxels) { progress.advance(voxels); });
  writer.writeCodes(codes, coding);
  const auto segments = makeSegmentDepth(options.classification, transfer, coding);
  progress.begin("attenuation", volume.header.voxels() * shared::kDirectionCount, "voxels");
  const auto sweepStart = Clock::now();
  StoredCodePlanes planes(codes, volume.header.dims);
  sweepAttenuation(planes, volume.header.dims, options.brickEdge, *segments, writer);
  result.sweepSeconds = secondsSince(sweepStart) - writer.writeSeconds();
  progress.end();

  const auto writeSection = [&](SectionType type, std::span<const std::byte> bytes) {
    checkEqual(uint64_t(bytes.size()), plan[type].bytes, "bytes of a section");
    plan[type].hash = contentHash(bytes);
    file.writeAt(plan[type].offset, bytes);
  };
  const std::vector<int8_t> directions = directionTable();
  const Metadata metadata = describe(volume.header, transfer, options, coding, result);
  writeSection(section::kMetadata, std::as_bytes(std::span(&metadata, 1)));
  writeSection(section::kTransfer, std::as_bytes(std::span(transferText)));
  writeSection(section::kDirections, std::as_bytes(std::span(directions)));
  writeSection(section::kCommand, std::as_bytes(std::span(options.command)));
  writeSection(section::kBricks, std::as_bytes(writer.entries()));
  plan[section::kCodes].hash = brickSectionHash(writer.entries(), &BrickEntry::codesHash);
  plan[section::kBackward].hash = brickSectionHash(writer.entries(), &BrickEntry::backwardHash);
  plan[section::kForward].hash = brickSectionHash(writer.entries(), &BrickEntry::forwardHash);

  // The header comes last: without it nothing takes the file for an attenuation file.
  FileHeader header{kFileMagic, kFileVersion, uint32_t(plan.sections().size()), plan.fileBytes(), 0};
  header.hash = headerHash(header, plan.sections());
  file.writeAt(sizeof(FileHeader), std::as_bytes(plan.sections()));
  file.writeAt(0, std::as_bytes(std::span(&header, 1)));
  file.commit();
  result.fileBytes = plan.fileBytes();
  result.writeSeconds = secondsSince(start) - result.sweepSeconds;
}

PrecomputeResult precomputeChecked(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                                   const PrecomputeOptions& options, Progress& progress) {
  const glm::ivec3 dims = volume.header.dims;
  const ValueCoding coding = valueCoding(volume.header.type, transfer.low, transfer.high);
  const std::vector<uint16_t> codes = encodeValues(volume, coding);
  const std::vector<StoredBrick> bricks = findStoredBricks(codes, dims, options.brickEdge, transfer, coding);
  PrecomputeResult result;
  result.voxels = volume.header.voxels();
  result.bricks = bricks.size();
  for (const StoredBrick& brick : bricks) {
    result.storedVoxels += voxelCount(brickExtent(brick.position, dims, options.brickEdge));
    result.visibleVoxels += brick.visibleVoxels;
  }
  result.nonFinite = valueStatistics(volume).nonFinite;
  result.largestValueError = largestCodingError(volume, codes, coding, transfer);
  writeFile(volume, transfer, codes, coding, bricks, path, options, progress, result);
  return result;
}

}  // namespace

PrecomputeResult precompute(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                            const PrecomputeOptions& options, Progress& progress) {
  checkOptions(options, path);
  check(validDims(volume.header.dims), "volume dims are valid");
  checkEqual(uint64_t(volume.data.size()), volume.header.bytes(), "bytes of the volume");
  volume.header.placement.check();
  try {
    return precomputeChecked(volume, transfer, path, options, progress);
  } catch (const std::bad_alloc&) {
    const glm::ivec3 dims = volume.header.dims;
    throw MachineError(
        fmt::format("{}: not enough memory to precompute {} x {} x {} voxels; try a machine with more, or "
                    "a volume cropped or reduced",
                    path, dims.x, dims.y, dims.z));
  }
}

}  // namespace freevoxel
