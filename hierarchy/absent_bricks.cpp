#include "hierarchy/absent_bricks.h"

#include <algorithm>
#include <glm/common.hpp>

#include "base/error.h"
#include "base/first_exception.h"
#include "base/grid.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

namespace {

constexpr uint64_t kNoSource = UINT64_MAX;

/// For each brick that is not stored, which corner of which stored one its code is that of, 8 * brick + corner; for
/// stored ones, and if there are none, kNoSource.
std::vector<uint64_t> sourcesOfAbsent(glm::ivec3 bricks, const std::vector<uint8_t>& stored) {
  std::vector<uint64_t> sources(stored.size(), kNoSource);
  std::vector<uint8_t> known = stored;
  std::vector<glm::ivec3> front;
  for (int z = 0; z < bricks.z; ++z) {
    for (int y = 0; y < bricks.y; ++y) {
      for (int x = 0; x < bricks.x; ++x) {
        if (known[linearIndex({x, y, z}, bricks)] != 0) front.emplace_back(x, y, z);
      }
    }
  }
  // Outwards from the stored ones.
  for (size_t next = 0; next < front.size(); ++next) {
    const glm::ivec3 from = front[next];
    const uint64_t fromIndex = linearIndex(from, bricks);
    for (int n = 0; n < 27; ++n) {
      const glm::ivec3 step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      const glm::ivec3 to = from + step;
      if (glm::clamp(to, glm::ivec3(0), bricks - 1) != to) continue;
      const uint64_t index = linearIndex(to, bricks);
      if (known[index] != 0) continue;
      known[index] = 1;
      front.push_back(to);
      // The voxel of `from` that touches `to`.
      const uint64_t corner = (step.x > 0 ? 1u : 0u) | (step.y > 0 ? 2u : 0u) | (step.z > 0 ? 4u : 0u);
      sources[index] = stored[fromIndex] != 0 ? 8 * fromIndex + corner : sources[fromIndex];
    }
  }
  return sources;
}

}  // namespace

std::vector<uint16_t> absentBrickCodes(glm::ivec3 bricks, const std::vector<uint8_t>& stored,
                                       const std::vector<CornerCodes>& corners) {
  const std::vector<uint64_t> sources = sourcesOfAbsent(bricks, stored);
  std::vector<uint16_t> codes(stored.size(), 0);
  for (size_t i = 0; i < codes.size(); ++i) {
    if (sources[i] != kNoSource) codes[i] = corners[sources[i] / 8][sources[i] % 8];
  }
  return codes;
}

CornerCodes cornerCodes(const AttenuationFile& file, size_t b) {
  const BrickView brick = file.brick(b, DirectionSet(0));
  const glm::ivec3 last = brickExtent(brick.origin / brick.edge, file.dims(), brick.edge) - 1;
  CornerCodes codes;
  for (size_t corner = 0; corner < 8; ++corner) {
    const glm::ivec3 local((corner & 1) ? last.x : 0, (corner & 2) ? last.y : 0, (corner & 4) ? last.z : 0);
    const size_t step = brick.steps[linearIndex(local, glm::ivec3(brick.edge))];
    // A damaged file may hold codes beyond the tables made for them.
    codes[corner] = uint16_t(std::min(brick.code(step), file.coding().largest));
  }
  file.checkIntact();
  return codes;
}

AbsentBricks::AbsentBricks(const AttenuationFile& file)
    : file_(file), bricks_(brickDims(file.dims(), file.brickEdge())) {
  std::vector<uint8_t> stored(voxelCount(bricks_), 0);
  for (size_t i = 0; i < file.brickCount(); ++i)
    stored[linearIndex(file.brickOrigin(i) / file.brickEdge(), bricks_)] = 1;
  sources_ = sourcesOfAbsent(bricks_, stored);
}

void AbsentBricks::read(std::span<const glm::ivec3> positions) {
  std::vector<uint64_t> unknown;
  for (const glm::ivec3 position : positions) {
    const uint64_t source = sources_[linearIndex(position, bricks_)];
    if (source != kNoSource && corners_.count(source / 8) == 0) unknown.push_back(source / 8);
  }
  std::sort(unknown.begin(), unknown.end());
  unknown.erase(std::unique(unknown.begin(), unknown.end()), unknown.end());
  std::vector<CornerCodes> codes(unknown.size());
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 8)
  for (int64_t i = 0; i < int64_t(unknown.size()); ++i) {
    failure.guard([&] {
      const uint64_t brick = unknown[size_t(i)], across = uint64_t(bricks_.x), along = uint64_t(bricks_.y);
      const glm::ivec3 at(int(brick % across), int(brick / across % along), int(brick / (across * along)));
      codes[size_t(i)] = cornerCodes(file_, file_.findBrick(at).value());
    });
  }
  failure.rethrow();
  for (size_t i = 0; i < unknown.size(); ++i)
    corners_.emplace(unknown[i], codes[i]);
}

uint16_t AbsentBricks::code(glm::ivec3 position) const {
  const uint64_t source = sources_[linearIndex(position, bricks_)];
  if (source == kNoSource) return 0;  // nothing is stored
  const auto found = corners_.find(source / 8);
  check(found != corners_.end(), "codes of bricks that are not stored are read before");
  return found->second[source % 8];
}

}  // namespace freevoxel
