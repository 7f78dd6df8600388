#include "precompute/level_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>
#include <numbers>
#include <utility>

#include "base/error.h"
#include "base/first_exception.h"
#include "base/give_back.h"
#include "base/grid.h"
#include "precompute/checksums.h"
#include "precompute/hilbert.h"

namespace freevoxel {

namespace {

constexpr size_t kMatter = 0;  // sections by number; attenuation of pass p is 1 + p

size_t cube(int edge) {
  return size_t(edge) * size_t(edge) * size_t(edge);
}

std::vector<uint64_t> parents(const std::vector<uint64_t>& sorted) {
  std::vector<uint64_t> result;
  for (const uint64_t index : sorted) {
    if (result.empty() || result.back() != index >> 3) result.push_back(index >> 3);
  }
  return result;
}

std::vector<uint64_t> indicesOf(std::span<const StoredBrick> bricks) {
  std::vector<uint64_t> result;
  for (const StoredBrick& brick : bricks)
    result.push_back(brick.hilbertIndex);
  return result;
}

}  // namespace

LevelBuilder::LevelBuilder(AtomicFile& file, const std::array<uint64_t, 3>& offsets, const Shape& shape,
                           std::span<const StoredBrick> bricks, const TransferFunction& transfer,
                           const ValueCoding& coding)
    : file_(file), shape_(shape), finest_(transfer, coding) {
  check(shape.levels >= 2 && shape.levels <= mostHierarchyLevels(shape.dims, shape.brickEdge),
        "number of levels is in range");
  for (size_t which = 0; which < sections_.size(); ++which)
    sections_[which].offset = offsets[which];
  for (uint32_t code = 0; code <= coding.largest; ++code) {
    weights_.push_back(-std::expm1(-transfer.at(coding.decode(code)).extinction));
  }
  std::vector<uint64_t> indices = indicesOf(bricks);
  const int order = brickCurveOrder(shape.dims, shape.brickEdge);
  levels_.resize(size_t(shape.levels));
  for (int level = 1; level < shape.levels; ++level) {
    indices = parents(indices);
    Level& made = levels_[size_t(level)];
    made.dims = dimsOfLevel(shape.dims, level);
    made.layers.resize(size_t(brickDims(made.dims, shape.brickEdge).z));
    for (const uint64_t index : indices) {
      const glm::ivec3 position = hilbertPosition(index, order - level);
      const auto steps =
          hilbertSteps(hilbertState(position, order - level), std::countr_zero(unsigned(shape.brickEdge)));
      made.layers[size_t(position.z)].push_back({position, entries_.size(), steps});
      LevelEntry entry{};
      entry.level = uint32_t(level);
      entry.hilbertIndex = index;
      entries_.push_back(entry);
    }
  }
  const glm::ivec3 topDims = dimsOfLevel(shape.dims, topInSlab());
  topMatter_ = {topDims, std::vector<LevelMatter>(voxelCount(topDims))};
  for (auto& depths : topDepths_)
    depths.resize(kDirectionsPerSection * voxelCount(topDims));
}

uint64_t LevelBuilder::brickCount(std::span<const StoredBrick> bricks, int levels) {
  uint64_t count = 0;
  std::vector<uint64_t> indices = indicesOf(bricks);
  for (int level = 1; level < levels; ++level) {
    indices = parents(indices);
    count += indices.size();
  }
  return count;
}

uint64_t LevelBuilder::largestMatter(uint64_t bricks, int edge) {
  return bricks * largestFrame(kMatterPlanes * sizeof(uint16_t) * cube(edge));
}

uint64_t LevelBuilder::largestAttenuation(uint64_t bricks, int edge) {
  return bricks * largestFrame(kDirectionsPerSection * cube(edge));
}

uint64_t LevelBuilder::memoryBytes(const Shape& shape, int passes) {
  const uint64_t edge = uint64_t(shape.brickEdge);
  uint64_t bytes = 0;
  for (int level = 1; level < shape.levels; ++level) {
    const glm::ivec3 bricks = brickDims(dimsOfLevel(shape.dims, level), shape.brickEdge);
    const uint64_t layer = uint64_t(bricks.x) * uint64_t(bricks.y) * cube(shape.brickEdge);
    // A layer of bricks, and their frames while they are packed.
    bytes += 2 * layer * std::max<uint64_t>(kMatterPlanes * sizeof(uint16_t), uint64_t(passes) * kDirectionsPerSection);
    bytes += layer / edge * ((edge >> level) + 1) *
             (2 * sizeof(LevelMatter) + uint64_t(passes) * kDirectionsPerSection * sizeof(LevelDepth));
  }
  const int top = std::min(shape.levels - 1, std::countr_zero(unsigned(shape.brickEdge)));
  const uint64_t topVoxels = voxelCount(dimsOfLevel(shape.dims, top));
  return bytes + topVoxels * (sizeof(LevelMatter) + sizeof(float) + 2 * kDirectionsPerSection * sizeof(LevelDepth));
}

int LevelBuilder::topInSlab() const {
  return std::min(shape_.levels - 1, std::countr_zero(unsigned(shape_.brickEdge)));
}

LevelBuilder::MatterPlanes LevelBuilder::coarser(const MatterPlanes& finer, int level) const {
  MatterPlanes result;
  result.dims = (finer.dims + 1) / 2;
  result.voxels.resize(voxelCount(result.dims));
  const glm::vec3 edges = shape_.edges * float(1 << (level - 1));
#pragma omp parallel for schedule(dynamic, 1)
  for (int row = 0; row < result.dims.y * result.dims.z; ++row) {
    const int y = row % result.dims.y, z = row / result.dims.y;
    for (int x = 0; x < result.dims.x; ++x) {
      std::array<const LevelMatter*, 8> children{};
      for (size_t child = 0; child < 8; ++child) {
        const glm::ivec3 p = 2 * glm::ivec3(x, y, z) + glm::ivec3(child & 1, child >> 1 & 1, child >> 2);
        if (p.x < finer.dims.x && p.y < finer.dims.y && p.z < finer.dims.z)
          children[child] = &finer.voxels[linearIndex(p, finer.dims)];
      }
      result.voxels[linearIndex({x, y, z}, result.dims)] = reducedMatter(children, edges);
    }
  }
  return result;
}

LevelBuilder::MatterPlanes LevelBuilder::matterOfCodes(int slab, std::span<const uint16_t> codes) const {
  const PlaneRange around = planesOfSlab(shape_.dims, shape_.brickEdge, slab);
  const int first = slab * shape_.brickEdge, planes = std::min(shape_.brickEdge, shape_.dims.z - first);
  const glm::ivec3 given(shape_.dims.x, shape_.dims.y, around.last - around.first);
  checkEqual(codes.size(), voxelCount(given), "codes of a slab and of the planes beside it");
  MatterPlanes result;
  result.dims = (glm::ivec3(shape_.dims.x, shape_.dims.y, planes) + 1) / 2;
  result.voxels.resize(voxelCount(result.dims));
#pragma omp parallel for schedule(dynamic, 1)
  for (int row = 0; row < result.dims.y * result.dims.z; ++row) {
    const int y = row % result.dims.y, z = row / result.dims.y;
    // The four planes and rows that the two of the row lie between; along x voxels follow on one another.
    const uint16_t* rows[16];
    for (int i = 0; i < 16; ++i) {
      const int py = std::clamp(2 * y - 1 + i % 4, 0, given.y - 1);
      const int pz = std::clamp(first + 2 * z - 1 + i / 4 - around.first, 0, given.z - 1);
      rows[i] = codes.data() + linearIndex({0, py, pz}, given);
    }
    const glm::ivec3 left(shape_.dims.x, shape_.dims.y - 2 * y, planes - 2 * z);
    for (int x = 0; x < result.dims.x; ++x) {
      FinestMatter::Codes around8;
      for (int i = 0; i < 64; ++i)
        around8[size_t(i)] = rows[i / 4][std::clamp(2 * x - 1 + i % 4, 0, given.x - 1)];
      std::array<LevelMatter, 8> matter;
      if (!finest_.ofEight(around8, matter)) continue;
      std::array<const LevelMatter*, 8> children{};
      for (size_t child = 0; child < 8; ++child) {
        const glm::ivec3 p(2 * x + int(child & 1), int(child >> 1 & 1), int(child >> 2));
        if (p.x < left.x && p.y < left.y && p.z < left.z) children[child] = &matter[child];
      }
      result.voxels[linearIndex({x, y, z}, result.dims)] = reducedMatter(children, shape_.edges);
    }
  }
  return result;
}

void LevelBuilder::addCodes(int slab, std::span<const uint16_t> codes) {
  MatterPlanes matter = matterOfCodes(slab, codes);
  for (int level = 1;; ++level) {
    const int firstPlane = slab * (shape_.brickEdge >> level);
    storeMatter(level, firstPlane, matter);
    if (level == topInSlab()) {
      std::copy(matter.voxels.begin(), matter.voxels.end(),
                topMatter_.voxels.begin() + ptrdiff_t(linearIndex({0, 0, firstPlane}, topMatter_.dims)));
      break;
    }
    matter = coarser(matter, level + 1);
  }
  if (size_t(slab) + 1 < size_t(brickDims(shape_.dims, shape_.brickEdge).z)) return;
  if (weighted()) topWeights_ = weightsOf(topMatter_, topInSlab());
  MatterPlanes whole = topMatter_;
  for (int level = topInSlab() + 1; level < shape_.levels; ++level) {
    whole = coarser(whole, level);
    storeMatter(level, 0, whole);
  }
}

LevelTarget LevelBuilder::target(int pass) {
  std::vector<LevelDepth>& depths = tapped_[size_t(pass)];
  depths.resize(kDirectionsPerSection * LevelTarget::directionSize(shape_.dims, shape_.brickEdge));
  return {depths.data(), weighted() ? weights_.data() : nullptr};
}

std::vector<float> LevelBuilder::weightsOf(const MatterPlanes& matter, int level) const {
  std::vector<float> weights(matter.voxels.size());
  const float edge = float(1 << level);
#pragma omp parallel for
  for (size_t i = 0; i < weights.size(); ++i)
    weights[i] = -std::expm1(-matter.voxels[i].extinction * edge);
  return weights;
}

std::vector<LevelDepth> LevelBuilder::coarser(const std::vector<LevelDepth>& finer, glm::ivec3 dims,
                                              const std::vector<float>& weights, glm::ivec3 coarseDims) const {
  const size_t fineVoxels = voxelCount(dims), coarseVoxels = voxelCount(coarseDims);
  std::vector<LevelDepth> result(kDirectionsPerSection * coarseVoxels);
#pragma omp parallel for schedule(dynamic, 1)
  for (int k = 0; k < kDirectionsPerSection; ++k) {
    const LevelDepth* from = finer.data() + size_t(k) * fineVoxels;
    LevelDepth* to = result.data() + size_t(k) * coarseVoxels;
    for (int z = 0; z < coarseDims.z; ++z) {
      for (int y = 0; y < coarseDims.y; ++y) {
        for (int x = 0; x < coarseDims.x; ++x, ++to) {
          uint32_t sum = 0, count = 0;
          float weighed = 0.0f, weight = 0.0f;
          for (int child = 0; child < 8; ++child) {
            const glm::ivec3 p = 2 * glm::ivec3(x, y, z) + glm::ivec3(child & 1, child >> 1 & 1, child >> 2);
            if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) continue;
            const uint64_t i = linearIndex(p, dims);
            sum += from[i];
            ++count;
            if (weights.empty()) continue;
            weighed += weights[i] * levelTransmittance(from[i]);
            weight += weights[i];
          }
          *to = weight > 0.0f ? levelDepth(weighed / weight) : LevelDepth((sum + count / 2) / count);
        }
      }
    }
  }
  return result;
}

void LevelBuilder::addDepths(int pass, int slab, std::span<const uint16_t> codes) {
  const int planes = std::min(shape_.brickEdge, shape_.dims.z - slab * shape_.brickEdge);
  glm::ivec3 dims = (glm::ivec3(shape_.dims.x, shape_.dims.y, planes) + 1) / 2;
  // Of the directions only the planes that exist.
  const size_t voxels = voxelCount(dims), reserved = LevelTarget::directionSize(shape_.dims, shape_.brickEdge);
  std::vector<LevelDepth> depths(kDirectionsPerSection * voxels);
  for (size_t k = 0; k < kDirectionsPerSection; ++k)
    std::copy_n(tapped_[size_t(pass)].data() + k * reserved, voxels, depths.data() + k * voxels);
  MatterPlanes matter;
  if (weighted()) matter = matterOfCodes(slab, codes);
  for (int level = 1;; ++level) {
    const int firstPlane = slab * (shape_.brickEdge >> level);
    storeDepths(pass, level, firstPlane, dims, depths);
    if (level == topInSlab()) {
      const size_t all = voxelCount(topMatter_.dims), own = voxelCount(dims);
      for (size_t k = 0; k < kDirectionsPerSection; ++k) {
        std::copy_n(depths.data() + k * own, own,
                    topDepths_[size_t(pass)].data() + k * all + linearIndex({0, 0, firstPlane}, topMatter_.dims));
      }
      break;
    }
    const glm::ivec3 next = (dims + 1) / 2;
    depths = coarser(depths, dims, weighted() ? weightsOf(matter, level) : std::vector<float>(), next);
    dims = next;
    if (weighted()) matter = coarser(matter, level + 1);
  }
  const int lastSlab = pass == 0 ? brickDims(shape_.dims, shape_.brickEdge).z - 1 : 0;
  if (slab != lastSlab) return;
  MatterPlanes whole = topMatter_;
  depths = topDepths_[size_t(pass)];
  std::vector<float> weights = topWeights_;
  for (int level = topInSlab() + 1; level < shape_.levels; ++level) {
    const glm::ivec3 next = (whole.dims + 1) / 2;
    depths = coarser(depths, whole.dims, weights, next);
    whole = coarser(whole, level);
    if (weighted()) weights = weightsOf(whole, level);
    storeDepths(pass, level, 0, next, depths);
  }
  giveBack(tapped_[size_t(pass)]);
  giveBack(topDepths_[size_t(pass)]);
}

void LevelBuilder::storeMatter(int level, int firstPlane, const MatterPlanes& matter) {
  const size_t voxels = cube(shape_.brickEdge);
  store(kMatter, level, firstPlane, matter.dims.z, kMatterPlanes * sizeof(uint16_t) * voxels, std::byte{0},
        [&](const Brick& brick, std::byte* buffer, int plane, int local) {
          const glm::ivec3 first = brick.position * shape_.brickEdge;
          const int rows = std::min(shape_.brickEdge, matter.dims.y - first.y);
          const int columns = std::min(shape_.brickEdge, matter.dims.x - first.x);
          const auto put = [&](size_t kind, size_t step, uint16_t value) {
            std::memcpy(buffer + (kind * voxels + step) * sizeof(value), &value, sizeof(value));
          };
          for (int y = 0; y < rows; ++y) {
            for (int x = 0; x < columns; ++x) {
              const LevelMatter& from = matter.voxels[linearIndex({first.x + x, first.y + y, plane}, matter.dims)];
              if (from.extinction <= 0.0f) continue;
              const size_t step = brick.steps[linearIndex({x, y, local}, glm::ivec3(shape_.brickEdge))];
              const glm::vec3 colour = glm::clamp(from.glow / from.extinction, 0.0f, 1.0f) * 65535.0f + 0.5f;
              put(0, step, uint16_t(colour.r));
              put(1, step, uint16_t(colour.g));
              put(2, step, uint16_t(colour.b));
              put(3, step, glm::packHalf1x16(from.extinction / std::numbers::ln2_v<float>));
            }
          }
        });
}

void LevelBuilder::storeDepths(int pass, int level, int firstPlane, glm::ivec3 dims,
                               const std::vector<LevelDepth>& depths) {
  const size_t voxels = cube(shape_.brickEdge), ofDirection = voxelCount(dims);
  store(
      size_t(pass) + 1, level, firstPlane, dims.z, kDirectionsPerSection * voxels, std::byte{kAttenuationOutside},
      [&](const Brick& brick, std::byte* buffer, int plane, int local) {
        const glm::ivec3 first = brick.position * shape_.brickEdge;
        const int rows = std::min(shape_.brickEdge, dims.y - first.y);
        const int columns = std::min(shape_.brickEdge, dims.x - first.x);
        for (size_t k = 0; k < kDirectionsPerSection; ++k) {
          for (int y = 0; y < rows; ++y) {
            const LevelDepth* row = depths.data() + k * ofDirection + linearIndex({first.x, first.y + y, plane}, dims);
            const uint16_t* steps = brick.steps.data() + linearIndex({0, y, local}, glm::ivec3(shape_.brickEdge));
            for (int x = 0; x < columns; ++x)
              buffer[k * voxels + steps[x]] = std::byte{levelCode(row[x])};
          }
        }
      });
}

template <class Fill>
void LevelBuilder::store(size_t which, int level, int firstPlane, int planes, size_t brickBytes, std::byte outside,
                         Fill&& fill) {
  Level& made = levels_[size_t(level)];
  Layer& layer = made.open[which];
  const int edge = shape_.brickEdge;
  // A slab's planes lie in one layer; of levels made as a whole, in all of them.
  for (int z = firstPlane / edge; z <= (firstPlane + planes - 1) / edge; ++z) {
    const std::vector<Brick>& bricks = made.layers[size_t(z)];
    layer.planes.resize(bricks.size());
    const int from = std::max(firstPlane, z * edge), to = std::min(firstPlane + planes, (z + 1) * edge);
    FirstException failure;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t b = 0; b < bricks.size(); ++b) {
      failure.guard([&] {
        if (layer.planes[b].empty()) layer.planes[b].assign(brickBytes, outside);
        for (int plane = from; plane < to; ++plane)
          fill(bricks[b], layer.planes[b].data(), plane - firstPlane, plane - z * edge);
      });
    }
    failure.rethrow();
    layer.filled += to - from;
    if (layer.filled == std::min(edge, made.dims.z - z * edge)) writeLayer(which, bricks, layer);
  }
}

void LevelBuilder::writeLayer(size_t which, const std::vector<Brick>& bricks, Layer& layer) {
  std::vector<Frame> frames(bricks.size());
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 1)
  for (size_t b = 0; b < bricks.size(); ++b) {
    failure.guard([&] {
      frames[b] = packCodes(layer.planes[b], which == kMatter ? 2 : 1);
      entries_[bricks[b].entry].hash[which] = contentHash(frames[b]);
      giveBack(layer.planes[b]);
    });
  }
  failure.rethrow();
  Section& section = sections_[which];
  Frame joined;
  for (size_t b = 0; b < bricks.size(); ++b) {
    LevelEntry& entry = entries_[bricks[b].entry];
    entry.offset[which] = section.bytes + joined.size();
    entry.bytes[which] = uint32_t(frames[b].size());
    joined.insert(joined.end(), frames[b].begin(), frames[b].end());
  }
  file_.writeAt(section.offset + section.bytes, joined);
  section.bytes += joined.size();
  layer = {};
}

}  // namespace freevoxel
