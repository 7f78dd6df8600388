#include "precompute/brick_writer.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <utility>

#include "base/first_exception.h"
#include "base/give_back.h"
#include "base/grid.h"
#include "precompute/hilbert.h"

namespace freevoxel {

namespace {

/// Writes the part of a volume in x order that belongs to one brick into the brick's plane, edge^3 entries in curve
/// order. `source`: the entry of the brick's first voxel, in an array of planes of dims.x * dims.y entries. `extent`:
/// voxels of the brick inside the volume; the others become `outside`.
template <class Source, class Target>
void permuteBrick(const Source* source, glm::ivec3 dims, glm::ivec3 extent, int edge, std::span<const uint16_t> steps,
                  Target outside, Target* plane) {
  if (extent != glm::ivec3(edge)) std::fill_n(plane, steps.size(), outside);
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      const Source* row = source + linearIndex({0, y, z}, dims);
      const uint16_t* step = steps.data() + linearIndex({0, y, z}, glm::ivec3(edge));
      for (int x = 0; x < extent.x; ++x)
        plane[step[x]] = Target(row[x]);
    }
  }
}

}  // namespace

BrickWriter::BrickWriter(BrickStore& store, std::span<const StoredBrick> bricks, glm::ivec3 dims, int edge,
                         std::function<void(uint64_t)> advanced)
    : store_(store),
      bricks_(bricks),
      dims_(dims),
      edge_(edge),
      advanced_(std::move(advanced)),
      slabs_(size_t(brickDims(dims, edge).z)) {
  const int order = brickCurveOrder(dims, edge);
  for (size_t i = 0; i < bricks.size(); ++i) {
    states_.push_back(hilbertState(bricks[i].position, order));
    steps_.push_back(hilbertSteps(states_.back(), std::countr_zero(unsigned(edge))));
    auto& slab = slabs_[size_t(bricks[i].position.z)];
    slab.push_back(i);
    largestSlab_ = std::max(largestSlab_, slab.size());
  }
}

void BrickWriter::writeCodes(int slab, std::span<const uint16_t> codes, const ValueCoding& coding) {
  if (coding.bytes() == 1) {
    writeCodesAs<uint8_t>(slab, codes);
  } else {
    writeCodesAs<uint16_t>(slab, codes);
  }
}

template <class Code>
void BrickWriter::writeCodesAs(int slab, std::span<const uint16_t> codes) {
  const std::vector<size_t>& bricks = slabs_[size_t(slab)];
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 4)
  for (size_t b = 0; b < bricks.size(); ++b) {
    failure.guard([&] {
      const size_t i = bricks[b];
      const glm::ivec3 position = bricks_[i].position;
      std::vector<Code> plane(brickVoxels());
      permuteBrick(codes.data() + linearIndex({position.x * edge_, position.y * edge_, 0}, dims_), dims_,
                   brickExtent(position, dims_, edge_), edge_, steps_[i], Code(0), plane.data());
      store_.codes(i, std::as_bytes(std::span(plane)));
    });
  }
  failure.rethrow();
  store_.endSlab();
}

std::span<const BrickPlanes> BrickWriter::begin(int pass, int slab) {
  auto& wanted = wanted_[size_t(pass)];
  wanted.clear();
  planes_[size_t(pass)].resize(passBytes() / sizeof(Line));
  uint8_t* planes = reinterpret_cast<uint8_t*>(planes_[size_t(pass)].data());
  for (const size_t i : slabs_[size_t(slab)]) {
    wanted.push_back({bricks_[i].position, states_[i], planes});
    planes += kDirectionsPerSection * brickVoxels();
  }
  return wanted;
}

LevelTarget BrickWriter::levels(int pass, int /*slab*/) {
  return levels_ != nullptr ? levels_->target(pass) : LevelTarget{};
}

void BrickWriter::complete(int pass, int slab) {
  const auto start = std::chrono::steady_clock::now();
  const std::vector<size_t>& bricks = slabs_[size_t(slab)];
  const uint64_t brickBytes = kDirectionsPerSection * brickVoxels();
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 4)
  for (size_t b = 0; b < bricks.size(); ++b) {
    failure.guard([&] {
      store_.attenuation(pass, bricks[b], std::span<const uint8_t>(wanted_[size_t(pass)][b].planes, brickBytes));
    });
  }
  failure.rethrow();
  store_.endSlab();
  if (levels_ != nullptr) {
    const PlaneRange around = planesOfSlab(dims_, edge_, slab);
    levels_->addDepths(pass, slab,
                       levels_->weighted() ? codes_->planes(pass, around.first, around.last - around.first)
                                           : std::span<const uint16_t>());
  }
  const glm::ivec3 slabDims(dims_.x, dims_.y, std::min(edge_, dims_.z - slab * edge_));
  const bool last = pass == 0 ? size_t(slab) + 1 == slabs_.size() : slab == 0;
  if (last) giveBack(planes_[size_t(pass)]);
  advanced_(voxelCount(slabDims) * kDirectionsPerSection);
  writeSeconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace freevoxel
