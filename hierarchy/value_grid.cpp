#include "hierarchy/value_grid.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/first_exception.h"
#include "hierarchy/absent_bricks.h"

namespace freevoxel {

namespace {

/// Gives bricks that are not stored one code each.
void fillAbsentBricks(ValueGrid& grid, const std::vector<uint8_t>& stored, glm::ivec3 bricks, int edge) {
  std::vector<CornerCodes> corners(stored.size());
  const auto forEachBrick = [&](bool wanted, auto&& use) {
    for (int z = 0; z < bricks.z; ++z) {
      for (int y = 0; y < bricks.y; ++y) {
        for (int x = 0; x < bricks.x; ++x) {
          const uint64_t i = linearIndex({x, y, z}, bricks);
          const glm::ivec3 first = glm::ivec3(x, y, z) * edge;
          if ((stored[i] != 0) == wanted) use(i, first, glm::min(first + edge, grid.dims) - 1);
        }
      }
    }
  };
  forEachBrick(true, [&](uint64_t i, glm::ivec3 first, glm::ivec3 last) {
    for (size_t corner = 0; corner < 8; ++corner) {
      const glm::ivec3 p((corner & 1) ? last.x : first.x, (corner & 2) ? last.y : first.y,
                         (corner & 4) ? last.z : first.z);
      corners[i][corner] = grid.codes[linearIndex(p, grid.dims)];
    }
  });
  const std::vector<uint16_t> codes = absentBrickCodes(bricks, stored, corners);
  forEachBrick(false, [&](uint64_t i, glm::ivec3 first, glm::ivec3 last) {
    for (int z = first.z; z <= last.z; ++z) {
      for (int y = first.y; y <= last.y; ++y) {
        std::fill_n(grid.codes.begin() + int64_t(linearIndex({first.x, y, z}, grid.dims)), last.x - first.x + 1,
                    codes[i]);
      }
    }
  });
}

}  // namespace

ValueGrid valueGrid(const Volume& volume, const TransferFunction& transfer) {
  ValueGrid grid;
  grid.dims = volume.header.dims;
  grid.placement = volume.header.placement;
  grid.coding = valueCoding(volume.header.type, transfer.low, transfer.high);
  grid.codes = encodeValues(volume, grid.coding);
  return grid;
}

ValueGrid valueGrid(const AttenuationFile& file) {
  ValueGrid grid;
  grid.dims = file.dims();
  grid.placement = file.placement();
  grid.coding = file.coding();
  grid.codes.assign(voxelCount(grid.dims), 0);
  const int edge = file.brickEdge();
  const glm::ivec3 bricks = (grid.dims + (edge - 1)) / edge;
  std::vector<uint8_t> known(voxelCount(bricks), 0);
  const int64_t count = int64_t(file.brickCount());
  const auto copyBrick = [&](size_t b) {
    const BrickView brick = file.brick(b, DirectionSet(0));
    known[linearIndex(brick.origin / edge, bricks)] = 1;
    for (size_t step = 0; step < brick.curve.size(); ++step) {
      const glm::ivec3 p = brick.origin + glm::ivec3(brick.curve[step].x, brick.curve[step].y, brick.curve[step].z);
      if (p.x < grid.dims.x && p.y < grid.dims.y && p.z < grid.dims.z) {
        // A damaged file may hold codes beyond the tables made for them.
        grid.codes[linearIndex(p, grid.dims)] = uint16_t(std::min(brick.code(step), grid.coding.largest));
      }
    }
  };
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 8)
  for (int64_t b = 0; b < count; ++b)
    failure.guard([&] {
      copyBrick(size_t(b));
      file.checkIntact();
    });
  failure.rethrow();
  fillAbsentBricks(grid, known, bricks, edge);
  return grid;
}

glm::dmat3 gradientFromDifferences(const ValueGrid& grid) {
  // A gradient is a covector: it goes with the transposed inverse of the axes.
  const glm::dmat3 worldFromIndex(grid.placement.worldFromIndex());
  return glm::transpose(glm::inverse(worldFromIndex)) * (grid.placement.unitLength() / grid.coding.largest);
}

glm::vec3 indexGradient(const ValueGrid& grid, glm::ivec3 p) {
  glm::vec3 gradient(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 low = p, high = p;
    low[axis] = std::max(0, p[axis] - 1);
    high[axis] = std::min(grid.dims[axis] - 1, p[axis] + 1);
    if (low[axis] == high[axis]) continue;
    gradient[axis] =
        (float(grid.codes[linearIndex(high, grid.dims)]) - float(grid.codes[linearIndex(low, grid.dims)])) /
        float(high[axis] - low[axis]);
  }
  return gradient;
}

glm::vec3 gradientAt(const ValueGrid& grid, glm::ivec3 p) {
  return glm::vec3(gradientFromDifferences(grid) * glm::dvec3(indexGradient(grid, p)));
}

}  // namespace freevoxel
