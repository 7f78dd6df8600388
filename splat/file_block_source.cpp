#include "splat/file_block_source.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/glm.hpp>
#include <iterator>
#include <utility>

#include "base/error.h"
#include "base/first_exception.h"
#include "base/grid.h"
#include "precompute/hilbert.h"
#include "precompute/stored_bricks.h"
#include "splat/cover_values.h"
#include "splat/grid_block_source.h"
#include "splat/near_field.h"

namespace freevoxel {

namespace {

/// Of a brick's position along each axis: more than any volume has bricks (validDims, validBrickEdge). Levels take the
/// rest.
constexpr int kPositionBits = 19;

glm::ivec3 atIndex(size_t i, int edge) {
  return {int(i) % edge, int(i) / edge % edge, int(i) / (edge * edge)};
}

/// Extinction that a surface's colour fully counts from, in log2 per shortest edge: an opacity of a half.
constexpr float kOpaqueExtinction = 1.0f;

/// Of a binary16 that is not negative and finite; exact.
float fromHalf(uint16_t bits) {
  return std::bit_cast<float>(uint32_t(bits) << 13) * 0x1p112f;
}

}  // namespace

FileBlockSource::FileBlockSource(const AttenuationFile& file, View view, std::optional<AbsentBricks>& absent,
                                 HeldBricks& bricks, int edge, uint64_t memoryBytes)
    : file_(file), view_(std::move(view)), absent_(absent), bricks_(bricks), edge_(edge), memoryBytes_(memoryBytes) {
  bricks_.beginFrame();
  checkEqual(view_.lamps.size(), view_.lighting == nullptr ? 0 : view_.lighting->lighting().lights.size(),
             "lamps and what lies before them");
  for (int level = 0; level < file.levels(); ++level) {
    Level looked{StoredAttenuation(file, view_.eye.towards, view_.eye.lookup, level), {}};
    for (const LampSource& lamp : view_.lamps) {
      looked.lamps.emplace_back();
      if (lamp.stored) looked.lamps.back().emplace(file, lamp.stored->towards, lamp.stored->lookup, level);
    }
    levels_.push_back(std::move(looked));
  }
  if (view_.eye.nearField) nearTargets_.push_back(-1);
  for (size_t n = 0; n < view_.lamps.size(); ++n) {
    if (near(0, view_.lamps[n].stored)) nearTargets_.push_back(int(n));
  }
  check(nearTargets_.empty() || (view_.table != nullptr && view_.visibility != nullptr),
        "near fields have what classifies values");
}

uint64_t FileBlockSource::bytesPerBlock(int edge, int brickEdge, const View& view) {
  const bool lit = view.lighting != nullptr, shaded = lit && view.lighting->shaded();
  uint64_t nearTargets = view.eye.nearField ? 1 : 0;
  for (const LampSource& lamp : view.lamps)
    nearTargets += lamp.stored && lamp.stored->nearField ? 1 : 0;
  // The block, its apron of one voxel before and two behind, wherever it lies among the bricks.
  const auto bricks = uint64_t((edge + 2) / brickEdge + 2);
  const uint64_t around = shaded || nearTargets > 0 ? bricks + 2 : bricks;
  const auto voxels = uint64_t(brickEdge) * uint64_t(brickEdge) * uint64_t(brickEdge);
  const uint64_t classified = sizeof(TableEntry) + (shaded ? sizeof(shared::CoverValue) : 0);
  return voxels * (bricks * bricks * bricks * (sizeof(uint16_t) + (lit ? sizeof(LightValue) : 0)) +
                   around * around * around * std::max(classified, (1 + nearTargets) * sizeof(uint16_t)));
}

std::vector<VisibleBlock> FileBlockSource::storedBlocks(const AttenuationFile& file, int level, int edge) {
  const glm::ivec3 dims = file.levelDims(level), blocks = brickDims(dims, edge);
  std::vector<uint8_t> stored(voxelCount(blocks), 0);
  std::vector<uint64_t> visible(stored.size(), 0);
  const auto brickVoxels = uint64_t(file.brickEdge()) * uint64_t(file.brickEdge()) * uint64_t(file.brickEdge());
  for (size_t i = 0; i < file.levelBrickCount(level); ++i) {
    const glm::ivec3 origin = file.levelBrickOrigin(level, i);
    visible[linearIndex(origin / edge, blocks)] += level == 0 ? file.visibleVoxelsOf(i) : brickVoxels;
    const glm::ivec3 low = origin / edge, high = glm::min(origin + (file.brickEdge() - 1), dims - 1) / edge;
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x)
          stored[linearIndex({x, y, z}, blocks)] = 1;
      }
    }
  }
  std::vector<std::pair<uint64_t, VisibleBlock>> found;
  const int order = hilbertOrder(blocks);
  for (int z = 0; z < blocks.z; ++z) {
    for (int y = 0; y < blocks.y; ++y) {
      for (int x = 0; x < blocks.x; ++x) {
        if (stored[linearIndex({x, y, z}, blocks)] == 0) continue;
        const glm::ivec3 origin = glm::ivec3(x, y, z) * edge;
        found.emplace_back(hilbertIndex({x, y, z}, order),
                           VisibleBlock{origin, origin, origin + edge, level, visible[linearIndex({x, y, z}, blocks)]});
      }
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<VisibleBlock> result;
  for (const auto& [index, block] : found)
    result.push_back(block);
  return result;
}

uint64_t FileBlockSource::key(const Place& place) {
  const auto part = [](int value, int shift) { return uint64_t(value) << shift; };
  return part(place.position.x, 0) | part(place.position.y, kPositionBits) | part(place.position.z, 2 * kPositionBits) |
         part(place.level, 3 * kPositionBits);
}

const HeldBrick& FileBlockSource::brick(const Place& place) const {
  const HeldBrick* found = bricks_.find(key(place));
  check(found != nullptr, "bricks of a block are ready");
  return *found;
}

std::vector<FileBlockSource::Place> FileBlockSource::bricksOf(std::span<const VisibleBlock> blocks) const {
  const int brickEdge = file_.brickEdge();
  std::unordered_map<uint64_t, Place> needed;
  for (const VisibleBlock& block : blocks) {
    const glm::ivec3 last = dims(block.level) - 1;
    const glm::ivec3 low = glm::clamp(block.origin - 1, glm::ivec3(0), last) / brickEdge;
    const glm::ivec3 high = glm::clamp(block.origin + edge_ + 1, glm::ivec3(0), last) / brickEdge;
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
          const Place place{block.level, {x, y, z}};
          needed.emplace(key(place), place);
        }
      }
    }
  }
  std::vector<Place> places;
  for (const auto& [number, place] : needed)
    places.push_back(place);
  return places;
}

std::vector<FileBlockSource::Place> FileBlockSource::withNeighbours(const std::vector<Place>& places, int most,
                                                                    bool corners) const {
  std::unordered_map<uint64_t, Place> all;
  for (const Place& place : places) {
    all.emplace(key(place), place);
    if (place.level > most) continue;
    const glm::ivec3 bricks = brickDims(dims(place.level), file_.brickEdge());
    for (int n = 0; n < 27; ++n) {
      const glm::ivec3 step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      if (!corners && std::abs(step.x) + std::abs(step.y) + std::abs(step.z) > 1) continue;
      const Place next{place.level, place.position + step};
      if (glm::clamp(next.position, glm::ivec3(0), bricks - 1) == next.position) all.emplace(key(next), next);
    }
  }
  std::vector<Place> result;
  for (const auto& [number, place] : all)
    result.push_back(place);
  return result;
}

void FileBlockSource::prepare(std::span<const VisibleBlock> blocks) {
  bricks_.nextCall();
  const std::vector<Place> needed = bricksOf(blocks);
  const bool shaded = lit() && view_.lighting->shaded();
  std::vector<Place> looked;
  if (!nearTargets_.empty()) {
    std::vector<Place> ofFinest;
    std::copy_if(needed.begin(), needed.end(), std::back_inserter(ofFinest),
                 [](const Place& place) { return place.level == 0; });
    looked = withNeighbours(ofFinest, 0, true);
  }
  std::unordered_map<uint64_t, Place> valued;
  for (const Place& place : shaded ? withNeighbours(needed, file_.levels(), false) : needed)
    valued.emplace(key(place), place);
  for (const Place& place : looked)
    valued.emplace(key(place), place);
  std::vector<std::pair<Place, HeldBrick*>> withoutValues, withoutFar, notViewed;
  std::vector<glm::ivec3> finest;
  for (const auto& [number, place] : valued) {
    HeldBrick& brick = bricks_.use(number);
    if (hasValues(place, brick)) continue;
    withoutValues.emplace_back(place, &brick);
    if (place.level == 0) finest.push_back(place.position);
  }
  for (const Place& place : looked) {
    HeldBrick& brick = bricks_.use(key(place));
    if (brick.farIn != bricks_.frame()) withoutFar.emplace_back(place, &brick);
  }
  for (const Place& place : needed) {
    HeldBrick& brick = bricks_.use(key(place));
    if (brick.viewedIn != bricks_.frame()) notViewed.emplace_back(place, &brick);
  }
  for (const auto* bricks : {&withoutFar, &notViewed}) {
    for (const auto& [place, brick] : *bricks) {
      if (const auto stored = file_.findLevelBrick(place.level, place.position)) file_.prefetch(place.level, *stored);
    }
  }
  if (!finest.empty() && !absent_) absent_.emplace(file_);
  if (!finest.empty()) absent_->read(finest);
  FirstException failure;
  // In rounds, since shading looks at neighbours' values, and near fields at their attenuation too.
  const auto readAll = [&](const std::vector<std::pair<Place, HeldBrick*>>& bricks, auto read) {
    std::vector<uint64_t> before;
    for (const auto& [place, brick] : bricks)
      before.push_back(brick->bytes());
#pragma omp parallel for schedule(dynamic, 1)
    for (int64_t i = 0; i < int64_t(bricks.size()); ++i)
      failure.guard([&] { (this->*read)(bricks[size_t(i)].first, *bricks[size_t(i)].second); });
    failure.rethrow();
    for (size_t i = 0; i < bricks.size(); ++i)
      bricks_.grow(before[i], bricks[i].second->bytes());
  };
  try {
    readAll(withoutValues, &FileBlockSource::readValues);
    readAll(withoutFar, &FileBlockSource::readFar);
    readAll(notViewed, &FileBlockSource::readAttenuation);
    file_.checkIntact();
  } catch (...) {
    bricks_.clear();  // some may be half read
    throw;
  }
  for (const auto& [place, brick] : withoutFar)
    brick->farIn = bricks_.frame();
  for (const auto& [place, brick] : notViewed)
    brick->viewedIn = bricks_.frame();
  mostHeld_ = std::max(mostHeld_, bricks_.bytes());
  bricks_.forget(memoryBytes_);
}

bool FileBlockSource::hasValues(const Place& place, const HeldBrick& brick) const {
  if (place.level == 0) return !brick.codes.empty();
  return (!matter() || !brick.matter.empty()) && (!cover() || !brick.cover.empty());
}

void FileBlockSource::readValues(const Place& place, HeldBrick& brick) const {
  const auto stored = file_.findLevelBrick(place.level, place.position);
  if (place.level == 0) {
    if (!stored) {
      brick.codes.assign(brickVoxels(), absent_->code(place.position));
      return;
    }
    const BrickView view = file_.brick(*stored, DirectionSet(0));
    brick.codes.resize(brickVoxels());
    for (size_t i = 0; i < brick.codes.size(); ++i) {
      // A damaged file may hold codes beyond the tables made for them.
      brick.codes[i] = uint16_t(std::min(view.code(view.steps[i]), file_.coding().largest));
    }
    return;
  }
  std::vector<TableEntry> read(brickVoxels(), TableEntry{0.0f, 0.0f, 0.0f, 0.0f});
  if (stored) {
    const BrickView view = file_.levelBrick(place.level, *stored, DirectionSet(0));
    for (size_t i = 0; i < read.size(); ++i) {
      const size_t step = view.steps[i];
      const float extinction = fromHalf(view.matter[3][step]);
      if (view_.white) {
        read[i] = {extinction, extinction, extinction, extinction};
        continue;
      }
      const float perUnit = extinction * (1.0f / 65535.0f);
      read[i] = {float(view.matter[0][step]) * perUnit, float(view.matter[1][step]) * perUnit,
                 float(view.matter[2][step]) * perUnit, extinction};
    }
  }
  if (cover()) coverOf(place.level, read, brick.cover);
  if (matter()) brick.matter = std::move(read);
}

void FileBlockSource::readFar(const Place& place, HeldBrick& brick) const {
  const glm::ivec3 edge(file_.brickEdge()), origin = place.position * edge;
  brick.far.resize(nearTargets_.size());
  for (std::vector<uint16_t>& towards : brick.far)
    towards.assign(brickVoxels(), uint16_t(AttenuationGrid::kUnit));
  if (const auto stored = file_.findLevelBrick(place.level, place.position)) {
    DirectionSet directions = 0;
    for (const int lamp : nearTargets_)
      directions |= lookup(place.level, lamp).directions(origin);
    const BrickView view = file_.levelBrick(place.level, *stored, directions);
    std::vector<float> looked(brickVoxels());
    for (size_t n = 0; n < nearTargets_.size(); ++n) {
      lookup(place.level, nearTargets_[n]).look(view, looked);
      for (size_t i = 0; i < looked.size(); ++i)
        brick.far[n][i] = uint16_t(looked[view.steps[i]] * AttenuationGrid::kUnit + 0.5f);
    }
  }
  for (size_t n = 0; n < nearTargets_.size(); ++n) {
    const CoarseRatio* ratio = target(nearTargets_[n]).ratio;
    if (ratio != nullptr) ratio->correct(origin, edge, place.level, brick.far[n]);
  }
}

void FileBlockSource::traceNearField(const Place& place, size_t n, std::span<uint16_t> attenuations) const {
  const int edge = file_.brickEdge();
  const glm::ivec3 origin = place.position * edge;
  NearFieldBox box = nearFieldBox(file_.dims(), origin, edge);
  std::vector<uint16_t> codes(voxelCount(box.size)), far(codes.size());
  copyBox(
      0, box.first, box.size, [](const HeldBrick& brick) { return brick.codes.data(); }, codes.data());
  copyBox(
      0, box.first, box.size, [&](const HeldBrick& brick) { return brick.far[n].data(); }, far.data());
  box.codes = codes;
  box.far = far;
  brickNearField(file_.dims(), *view_.table, *view_.visibility, target(nearTargets_[n]).towards, box, origin, edge,
                 attenuations);
}

void FileBlockSource::readAttenuation(const Place& place, HeldBrick& brick) const {
  const glm::ivec3 edge(file_.brickEdge()), origin = place.position * edge;
  const Level& level = levels_[size_t(place.level)];
  const bool nearEye = near(place.level, view_.eye);
  brick.attenuations.assign(brickVoxels(), uint16_t(AttenuationGrid::kUnit));
  const auto stored = file_.findLevelBrick(place.level, place.position);
  std::optional<BrickView> view;
  if (stored) {
    DirectionSet directions = nearEye ? 0 : level.eye.directions(origin);
    for (size_t n = 0; n < level.lamps.size(); ++n) {
      if (level.lamps[n] && !near(place.level, view_.lamps[n].stored)) directions |= level.lamps[n]->directions(origin);
    }
    if (directions != 0) view.emplace(file_.levelBrick(place.level, *stored, directions, false));
  }
  if (nearEye) {
    traceNearField(place, 0, brick.attenuations);
  } else {
    if (view) {
      std::vector<float> looked(brickVoxels());
      level.eye.look(*view, looked);
      for (size_t i = 0; i < looked.size(); ++i)
        brick.attenuations[i] = uint16_t(looked[view->steps[i]] * AttenuationGrid::kUnit + 0.5f);
    }
    if (view_.eye.ratio != nullptr) view_.eye.ratio->correct(origin, edge, place.level, brick.attenuations);
  }
  if (lit()) lightBrick(place, stored.has_value(), view ? &*view : nullptr, brick);
}

void FileBlockSource::lightBrick(const Place& place, bool stored, const BrickView* view, HeldBrick& brick) const {
  const int edge = file_.brickEdge();
  const size_t voxels = brickVoxels();
  brick.lights.assign(voxels, LightValue{0, 0, 0, 0});
  if (!stored) return;  // nothing is visible there
  const glm::ivec3 origin = place.position * edge;
  const double finest = double(1 << place.level);
  std::vector<glm::dvec3> places(voxels);
  for (size_t i = 0; i < voxels; ++i)
    places[i] = glm::dvec3(origin + atIndex(i, edge)) * finest + 0.5 * (finest - 1.0);
  std::vector<glm::vec3> slopes;
  if (view_.lighting->shaded()) slopes = gradients(place, brick);
  std::vector<float> passed(view_.lamps.size() * voxels), looked(voxels);
  std::vector<uint16_t> corrected(voxels);
  for (size_t n = 0; n < view_.lamps.size(); ++n) {
    const auto ofLamp = std::span(passed).subspan(n * voxels, voxels);
    const LampSource& lamp = view_.lamps[n];
    if (!lamp.stored) {
      for (size_t i = 0; i < voxels; ++i) {
        const glm::ivec3 p = glm::min(glm::ivec3(places[i]), file_.dims() - 1);
        ofLamp[i] = float(lamp.swept->values[linearIndex(p, file_.dims())]) * (1.0f / AttenuationGrid::kUnit);
      }
      continue;
    }
    if (near(place.level, lamp.stored)) {
      const auto found = std::find(nearTargets_.begin(), nearTargets_.end(), int(n));
      corrected.assign(voxels, uint16_t(AttenuationGrid::kUnit));
      traceNearField(place, size_t(found - nearTargets_.begin()), corrected);
      for (size_t i = 0; i < voxels; ++i)
        ofLamp[i] = float(corrected[i]) * (1.0f / AttenuationGrid::kUnit);
      continue;
    }
    levels_[size_t(place.level)].lamps[n]->look(*view, looked);
    for (size_t i = 0; i < voxels; ++i)
      ofLamp[i] = looked[view->steps[i]];
    if (lamp.stored->ratio == nullptr) continue;
    for (size_t i = 0; i < voxels; ++i)
      corrected[i] = uint16_t(ofLamp[i] * AttenuationGrid::kUnit + 0.5f);
    lamp.stored->ratio->correct(origin, glm::ivec3(edge), place.level, corrected);
    for (size_t i = 0; i < voxels; ++i)
      ofLamp[i] = float(corrected[i]) * (1.0f / AttenuationGrid::kUnit);
  }
  view_.lighting->light(places, slopes, passed, brick.lights);
}

std::vector<glm::vec3> FileBlockSource::gradients(const Place& place, const HeldBrick& own) const {
  const int edge = file_.brickEdge();
  const glm::ivec3 origin = place.position * edge, last = dims(place.level) - 1;
  // The bricks on either side of this one.
  const HeldBrick* beside[3][2] = {};
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      Place next = place;
      next.position[axis] += 2 * side - 1;
      if (next.position[axis] >= 0) beside[axis][side] = bricks_.find(key(next));
    }
  }
  const auto value = [&](const HeldBrick& brick, glm::ivec3 local) {
    const uint64_t i = linearIndex(local, glm::ivec3(edge));
    return place.level == 0 ? float(brick.codes[i]) : std::min(brick.matter[i].extinction, kOpaqueExtinction);
  };
  // A gradient is a covector: it goes with the transposed inverse of the axes. Values as shares of their range.
  const Placement& placement = file_.placement();
  const double range = place.level == 0 ? double(file_.coding().largest) : double(kOpaqueExtinction);
  const glm::mat3 gradientFromIndex(glm::transpose(glm::inverse(glm::dmat3(placement.worldFromIndex()))) *
                                    (placement.unitLength() / (range * double(1 << place.level))));
  std::vector<glm::vec3> result(brickVoxels(), glm::vec3(0.0f));
  for (size_t i = 0; i < result.size(); ++i) {
    const glm::ivec3 local = atIndex(i, edge), p = origin + local;
    if (glm::any(glm::greaterThan(p, last))) continue;
    glm::vec3 difference(0.0f);
    for (int axis = 0; axis < 3; ++axis) {
      const int low = std::max(p[axis] - 1, 0), high = std::min(p[axis] + 1, last[axis]);
      if (low == high) continue;
      const auto at = [&](int position) {
        glm::ivec3 there = local;
        there[axis] = position - origin[axis];
        const HeldBrick* brick = &own;
        if (there[axis] < 0) brick = beside[axis][0];
        if (there[axis] >= edge) brick = beside[axis][1];
        there[axis] = (there[axis] + edge) % edge;
        return value(*brick, there);
      };
      difference[axis] = (at(high) - at(low)) / float(high - low);
    }
    result[i] = gradientFromIndex * difference;
  }
  return result;
}

template <class T, class VoxelsOf>
void FileBlockSource::copyBox(int level, glm::ivec3 first, glm::ivec3 size, const VoxelsOf& voxelsOf, T* out) const {
  const int edge = file_.brickEdge(), shift = std::countr_zero(unsigned(edge)), mask = edge - 1;
  const glm::ivec3 last = dims(level) - 1;
  const glm::ivec3 low = glm::clamp(first, glm::ivec3(0), last) / edge;
  const glm::ivec3 high = glm::clamp(first + size - 1, glm::ivec3(0), last) / edge;
  const glm::ivec3 count = high - low + 1;
  std::vector<const T*> voxels(voxelCount(count));
  for (size_t i = 0; i < voxels.size(); ++i) {
    const glm::ivec3 at(int(i) % count.x, int(i) / count.x % count.y, int(i) / (count.x * count.y));
    voxels[i] = voxelsOf(brick({level, low + at}));
  }
  for (int z = 0; z < size.z; ++z) {
    const int pz = std::clamp(first.z + z, 0, last.z);
    for (int y = 0; y < size.y; ++y, out += size.x) {
      const int py = std::clamp(first.y + y, 0, last.y);
      const T* const* ofRow = voxels.data() + count.x * (((py >> shift) - low.y) + count.y * ((pz >> shift) - low.z));
      const int row = edge * ((py & mask) + edge * (pz & mask));
      // In runs that lie in one brick.
      for (int x = 0; x < size.x;) {
        const int px = std::clamp(first.x + x, 0, last.x);
        const T* from = ofRow[(px >> shift) - low.x] + row + (px & mask);
        const bool beyond = first.x + x != px;
        const int run = beyond ? 1 : std::min({size.x - x, edge - (px & mask), last.x - px + 1});
        std::copy_n(from, run, out + x);
        x += run;
      }
    }
  }
}

void FileBlockSource::gather(const VisibleBlock& block, BlockSamples& samples) const {
  const glm::ivec3 first = block.origin - 1, size(blockSide(edge_));
  const size_t voxels = blockVoxels(edge_);
  samples.codes.resize(block.level == 0 ? voxels : 0);
  samples.matter.resize(block.level == 0 || cover() ? 0 : voxels);
  samples.cover.resize(block.level == 0 || !cover() ? 0 : voxels);
  samples.attenuations.resize(voxels);
  samples.lights.resize(lit() ? voxels : 0);
  const auto copy = [&](auto member, auto& to) {
    copyBox(
        block.level, first, size, [&](const HeldBrick& brick) { return (brick.*member).data(); }, to.data());
  };
  copy(&HeldBrick::attenuations, samples.attenuations);
  if (!samples.codes.empty()) copy(&HeldBrick::codes, samples.codes);
  if (!samples.matter.empty()) copy(&HeldBrick::matter, samples.matter);
  if (!samples.cover.empty()) copy(&HeldBrick::cover, samples.cover);
  if (lit()) copy(&HeldBrick::lights, samples.lights);
  AttenuationGrid faces;
  faces.setOpenFaces(view_.eye.towards, file_.dims());
  openApron(faces.openLow, faces.openHigh, dims(block.level), block.origin, edge_, samples.attenuations);
}

}  // namespace freevoxel
