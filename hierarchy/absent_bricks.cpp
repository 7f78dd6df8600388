#include "hierarchy/absent_bricks.h"

#include <algorithm>
#include <glm/common.hpp>

#include "base/first_exception.h"
#include "base/grid.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

std::vector<uint16_t> absentBrickCodes(glm::ivec3 bricks, const std::vector<uint8_t>& stored,
                                       const std::vector<CornerCodes>& corners) {
  std::vector<uint16_t> codes(stored.size(), 0);
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
      const size_t corner = (step.x > 0 ? 1u : 0u) | (step.y > 0 ? 2u : 0u) | (step.z > 0 ? 4u : 0u);
      codes[index] = stored[fromIndex] != 0 ? corners[fromIndex][corner] : codes[fromIndex];
    }
  }
  return codes;
}

std::vector<uint16_t> absentBrickCodes(const AttenuationFile& file) {
  const glm::ivec3 bricks = brickDims(file.dims(), file.brickEdge());
  std::vector<uint8_t> stored(voxelCount(bricks), 0);
  std::vector<CornerCodes> corners(stored.size());
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 8)
  for (int64_t b = 0; b < int64_t(file.brickCount()); ++b) {
    failure.guard([&] {
      const BrickView brick = file.brick(size_t(b), DirectionSet(0));
      const glm::ivec3 position = brick.origin / brick.edge;
      const glm::ivec3 last = brickExtent(position, file.dims(), brick.edge) - 1;
      const uint64_t index = linearIndex(position, bricks);
      stored[index] = 1;
      for (size_t corner = 0; corner < 8; ++corner) {
        const glm::ivec3 local((corner & 1) ? last.x : 0, (corner & 2) ? last.y : 0, (corner & 4) ? last.z : 0);
        const size_t step = brick.steps[linearIndex(local, glm::ivec3(brick.edge))];
        // A damaged file may hold codes beyond the tables made for them.
        corners[index][corner] = uint16_t(std::min(brick.code(step), file.coding().largest));
      }
      file.checkIntact();
    });
  }
  failure.rethrow();
  return absentBrickCodes(bricks, stored, corners);
}

}  // namespace freevoxel
