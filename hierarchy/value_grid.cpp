#include "hierarchy/value_grid.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/first_exception.h"

namespace freevoxel {

namespace {

/// Gives bricks that are not stored one code each, spreading outwards from the stored ones.
///
/// A stored voxel next to an absent one shares an invisible cell with it, so both lie in one interval of values that is
/// invisible throughout; and absent voxels that touch lie in one such interval too. Any code from that interval is
/// therefore as good as the lost one, and a neighbour's is in it.
void fillAbsentBricks(ValueGrid& grid, std::vector<uint8_t> known, glm::ivec3 bricks, int edge) {
  std::vector<glm::ivec3> front;
  for (int z = 0; z < bricks.z; ++z) {
    for (int y = 0; y < bricks.y; ++y) {
      for (int x = 0; x < bricks.x; ++x) {
        if (known[linearIndex({x, y, z}, bricks)] != 0) front.emplace_back(x, y, z);
      }
    }
  }
  for (size_t next = 0; next < front.size(); ++next) {
    const glm::ivec3 from = front[next];
    for (int n = 0; n < 27; ++n) {
      const glm::ivec3 step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
      const glm::ivec3 to = from + step;
      if (glm::clamp(to, glm::ivec3(0), bricks - 1) != to || known[linearIndex(to, bricks)] != 0) continue;
      known[linearIndex(to, bricks)] = 1;
      front.push_back(to);
      const glm::ivec3 first = to * edge;
      const glm::ivec3 last = glm::min(first + edge, grid.dims) - 1;
      // The voxel of `from` that touches `to`.
      const glm::ivec3 fromFirst = from * edge;
      const glm::ivec3 fromLast = glm::min(fromFirst + edge, grid.dims) - 1;
      const uint16_t code = grid.codes[linearIndex(glm::clamp(first, fromFirst, fromLast), grid.dims)];
      for (int z = first.z; z <= last.z; ++z) {
        for (int y = first.y; y <= last.y; ++y) {
          std::fill_n(grid.codes.begin() + int64_t(linearIndex({first.x, y, z}, grid.dims)), last.x - first.x + 1,
                      code);
        }
      }
    }
  }
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
  fillAbsentBricks(grid, std::move(known), bricks, edge);
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
