#include "precompute/stored_bricks.h"

#include <algorithm>
#include <cstddef>

#include "base/error.h"
#include "base/grid.h"
#include "precompute/hilbert.h"
#include "volume/code_visibility.h"

namespace freevoxel {

namespace {

/// Smallest and largest code of every group of neighbouring voxels, one plane.
struct RangePlane {
  std::vector<uint16_t> low, high;
};

/// Ranges over the 2 x 2 voxels of one z plane that start at each voxel, clamped at the border.
void rangesOfPlane(const uint16_t* codes, glm::ivec3 dims, RangePlane& pairs, RangePlane& result) {
  for (int y = 0; y < dims.y; ++y) {
    const uint16_t* row = codes + size_t(y) * size_t(dims.x);
    uint16_t* low = pairs.low.data() + size_t(y) * size_t(dims.x);
    uint16_t* high = pairs.high.data() + size_t(y) * size_t(dims.x);
    for (int x = 0; x + 1 < dims.x; ++x) {
      low[x] = std::min(row[x], row[x + 1]);
      high[x] = std::max(row[x], row[x + 1]);
    }
    low[dims.x - 1] = high[dims.x - 1] = row[dims.x - 1];
  }
  const size_t lastRow = size_t(dims.y - 1) * size_t(dims.x);
  for (size_t i = 0; i < lastRow; ++i) {
    result.low[i] = std::min(pairs.low[i], pairs.low[i + size_t(dims.x)]);
    result.high[i] = std::max(pairs.high[i], pairs.high[i + size_t(dims.x)]);
  }
  std::copy_n(pairs.low.begin() + ptrdiff_t(lastRow), dims.x, result.low.begin() + ptrdiff_t(lastRow));
  std::copy_n(pairs.high.begin() + ptrdiff_t(lastRow), dims.x, result.high.begin() + ptrdiff_t(lastRow));
}

/// Marks the bricks of one slab that visible cells of one plane of cells touch. Cells at a clamped border need no mark
/// of their own: the cell beside them has the same corners and more.
void markBricks(const CodeVisibility& visibility, const RangePlane& lower, const RangePlane& upper, glm::ivec3 dims,
                int edge, std::vector<uint8_t>& marks) {
  const glm::ivec3 bricks = brickDims(dims, edge);
  for (int y = 0; y < dims.y; ++y) {
    const size_t row = size_t(y) * size_t(dims.x);
    const int firstBrickY = y / edge;
    const int lastBrickY = std::min(y + 1, dims.y - 1) / edge;
    for (int brickX = 0; brickX < bricks.x; ++brickX) {
      uint8_t* first = &marks[size_t(firstBrickY) * size_t(bricks.x) + size_t(brickX)];
      uint8_t* last = &marks[size_t(lastBrickY) * size_t(bricks.x) + size_t(brickX)];
      if (*first != 0 && *last != 0) continue;
      const int begin = std::max(brickX * edge - 1, 0);
      const int end = std::min((brickX + 1) * edge, dims.x);
      for (int x = begin; x < end; ++x) {
        const size_t i = row + size_t(x);
        if (visibility.between(std::min(lower.low[i], upper.low[i]), std::max(lower.high[i], upper.high[i]))) {
          *first = *last = 1;
          break;
        }
      }
    }
  }
}

/// `codes`: of planesOfSlab().
std::vector<uint8_t> markSlab(const CodeVisibility& visibility, const uint16_t* codes, glm::ivec3 dims, int edge,
                              int slab) {
  const size_t planeVoxels = size_t(dims.x) * size_t(dims.y);
  const glm::ivec3 bricks = brickDims(dims, edge);
  std::vector<uint8_t> marks(size_t(bricks.x) * size_t(bricks.y));
  RangePlane pairs, lower, upper;
  for (RangePlane* plane : {&pairs, &lower, &upper}) {
    plane->low.resize(planeVoxels);
    plane->high.resize(planeVoxels);
  }
  const int first = planesOfSlab(dims, edge, slab).first;
  const int last = std::min((slab + 1) * edge, dims.z) - 1;
  rangesOfPlane(codes, dims, pairs, lower);
  for (int z = first; z <= last; ++z) {
    const int above = std::min(z + 1, dims.z - 1);
    rangesOfPlane(codes + size_t(above - first) * planeVoxels, dims, pairs, upper);
    markBricks(visibility, lower, upper, dims, edge, marks);
    std::swap(lower, upper);
  }
  return marks;
}

/// `codes`: of the planes from `firstPlane` on.
uint32_t countVisible(const CodeVisibility& visibility, std::span<const uint16_t> codes, int firstPlane,
                      glm::ivec3 dims, glm::ivec3 position, int edge) {
  const glm::ivec3 extent = brickExtent(position, dims, edge);
  uint32_t count = 0;
  for (int z = 0; z < extent.z; ++z) {
    for (int y = 0; y < extent.y; ++y) {
      const uint16_t* row = codes.data() + linearIndex(position * edge + glm::ivec3(0, y, z - firstPlane), dims);
      for (int x = 0; x < extent.x; ++x)
        count += visibility.voxel(row[x]) ? 1u : 0u;
    }
  }
  return count;
}

}  // namespace

glm::ivec3 brickDims(glm::ivec3 dims, int edge) {
  return (dims + (edge - 1)) / edge;
}

glm::ivec3 dimsOfLevel(glm::ivec3 dims, int level) {
  return (dims + ((1 << level) - 1)) >> level;
}

int mostHierarchyLevels(glm::ivec3 dims, int edge) {
  return brickCurveOrder(dims, edge) + 1;
}

int brickCurveOrder(glm::ivec3 dims, int edge) {
  return hilbertOrder(brickDims(dims, edge));
}

glm::ivec3 brickExtent(glm::ivec3 position, glm::ivec3 dims, int edge) {
  const glm::ivec3 rest = dims - position * edge;
  return {std::min(rest.x, edge), std::min(rest.y, edge), std::min(rest.z, edge)};
}

PlaneRange planesOfSlab(glm::ivec3 dims, int edge, int slab) {
  return {std::max(slab * edge - 1, 0), std::min((slab + 1) * edge + 1, dims.z)};
}

std::vector<StoredBrick> findStoredBricks(std::span<const uint16_t> codes, glm::ivec3 dims, int edge, int slab,
                                          const CodeVisibility& visibility) {
  const glm::ivec3 bricks = brickDims(dims, edge);
  const int order = brickCurveOrder(dims, edge);
  const int firstPlane = planesOfSlab(dims, edge, slab).first;
  const std::vector<uint8_t> marks = markSlab(visibility, codes.data(), dims, edge, slab);
  std::vector<StoredBrick> found;
  for (int y = 0; y < bricks.y; ++y) {
    for (int x = 0; x < bricks.x; ++x) {
      if (marks[size_t(y) * size_t(bricks.x) + size_t(x)] == 0) continue;
      const glm::ivec3 position(x, y, slab);
      found.push_back(
          {hilbertIndex(position, order), position, countVisible(visibility, codes, firstPlane, dims, position, edge)});
    }
  }
  return found;
}

std::vector<StoredBrick> findStoredBricks(std::span<const uint16_t> codes, glm::ivec3 dims, int edge,
                                          const TransferFunction& transfer, const ValueCoding& coding) {
  check(validDims(dims) && edge >= 1, "dims and brick edge are positive");
  checkEqual(uint64_t(codes.size()), voxelCount(dims), "number of codes");
  const CodeVisibility visibility(transfer, coding);
  const size_t planeVoxels = size_t(dims.x) * size_t(dims.y);
  std::vector<StoredBrick> stored;
#pragma omp parallel for schedule(dynamic)
  for (int slab = 0; slab < brickDims(dims, edge).z; ++slab) {
    const PlaneRange planes = planesOfSlab(dims, edge, slab);
    const auto window =
        codes.subspan(size_t(planes.first) * planeVoxels, size_t(planes.last - planes.first) * planeVoxels);
    const std::vector<StoredBrick> found = findStoredBricks(window, dims, edge, slab, visibility);
#pragma omp critical(freevoxelStoredBricks)
    stored.insert(stored.end(), found.begin(), found.end());
  }
  sortAlongCurve(stored);
  return stored;
}

void sortAlongCurve(std::vector<StoredBrick>& bricks) {
  std::sort(bricks.begin(), bricks.end(),
            [](const StoredBrick& a, const StoredBrick& b) { return a.hilbertIndex < b.hilbertIndex; });
}

}  // namespace freevoxel
