#include "voxlink/buffers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel {

void checkBrickEdge(int edge) {
  if (edge != 4 && edge != 8 && edge != 16) {
    throw InputError(fmt::format("VoxLink: expected a brick size of 4, 8 or 16, found {}", edge));
  }
}

BrickGrid brickGrid(int edge, glm::ivec3 low, glm::ivec3 high) {
  checkBrickEdge(edge);
  check(low.x < high.x && low.y < high.y && low.z < high.z, "the box of stored voxels is not empty");
  BrickGrid grid{edge, low, high, low / edge, glm::ivec3(0)};
  grid.count = (high - 1) / edge - grid.first + 1;
  return grid;
}

void writeHeader(uint32_t* header, int edge, uint32_t first, const uint16_t* masks) {
  std::fill_n(header, shared::headerWords(edge), 0u);
  header[0] = first;
  uint32_t before = 0;
  for (int column = 0; column < edge * edge; ++column) {
    const int bit = column * edge;
    if (bit % 64 == 0) header[shared::startWord(edge, bit)] |= before << shared::startShift(bit);
    header[shared::maskWord(bit)] |= uint32_t(masks[column]) << (bit & 31);
    before += uint32_t(std::popcount(masks[column]));
  }
}

std::optional<size_t> BrickLists::stored(glm::ivec3 voxel) const {
  for (int axis = 0; axis < 3; ++axis) {
    if (voxel[axis] < grid.low[axis] || voxel[axis] >= grid.high[axis]) return std::nullopt;
  }
  const uint32_t* brick = header(voxel / grid.edge);
  if (brick == nullptr) return std::nullopt;
  const glm::ivec3 local = voxel % grid.edge;
  const int column = local.y * grid.edge + local.x;
  if ((listMask(brick, grid.edge, column) >> local.z & 1u) == 0) return std::nullopt;
  return storedVoxel(brick, grid.edge, column * grid.edge + local.z);
}

std::vector<uint8_t> storedCodes(const TransferFunction& transfer, const ValueCoding& coding, double threshold) {
  std::vector<uint8_t> stored(size_t(coding.largest) + 1);
  for (size_t code = 0; code < stored.size(); ++code)
    stored[code] = transfer.opacityAt(coding.decode(double(code))) > threshold ? 1 : 0;
  return stored;
}

std::vector<VoxelMaterial> voxelMaterials(const TransferFunction& transfer, const ValueCoding& coding,
                                          const std::vector<uint8_t>& stored) {
  checkEqual(stored.size(), size_t(coding.largest) + 1, "codes of the volume");
  std::vector<VoxelMaterial> materials(stored.size());
  for (size_t code = 0; code < stored.size(); ++code) {
    const Classified c = transfer.at(coding.decode(double(code)));
    materials[code] = {c.linear.r, c.linear.g, c.linear.b, stored[code] != 0 ? c.extinction : 0.0f};
  }
  return materials;
}

bool needsRebuild(const ValueGrid& grid, const std::vector<uint8_t>& built, const std::vector<uint8_t>& wanted) {
  checkEqual(built.size(), wanted.size(), "codes of the volume");
  std::vector<uint8_t> added(built.size());
  bool any = false;
  for (size_t code = 0; code < built.size(); ++code) {
    added[code] = wanted[code] != 0 && built[code] == 0 ? 1 : 0;
    any = any || added[code] != 0;
  }
  return any && std::any_of(grid.codes.begin(), grid.codes.end(), [&](uint16_t code) { return added[code] != 0; });
}

namespace {

/// The box of the stored voxels; empty (low > high) without any.
void fitBox(const ValueGrid& grid, const std::vector<uint8_t>& stored, glm::ivec3& low, glm::ivec3& high) {
  low = grid.dims;
  high = glm::ivec3(0);
#pragma omp parallel
  {
    glm::ivec3 ownLow = grid.dims, ownHigh(0);
#pragma omp for schedule(dynamic, 4)
    for (int z = 0; z < grid.dims.z; ++z) {
      for (int y = 0; y < grid.dims.y; ++y) {
        const uint16_t* row = grid.codes.data() + linearIndex({0, y, z}, grid.dims);
        int first = 0, last = grid.dims.x - 1;
        while (first <= last && stored[row[first]] == 0)
          ++first;
        if (first > last) continue;
        while (stored[row[last]] == 0)
          --last;
        ownLow = glm::min(ownLow, glm::ivec3(first, y, z));
        ownHigh = glm::max(ownHigh, glm::ivec3(last, y, z) + 1);
      }
    }
#pragma omp critical(freevoxelFitBox)
    {
      low = glm::min(low, ownLow);
      high = glm::max(high, ownHigh);
    }
  }
}

/// Masks of a brick's columns, x fastest, and how many voxels they hold.
uint32_t columnMasks(const ValueGrid& grid, const std::vector<uint8_t>& stored, glm::ivec3 first, int edge,
                     uint16_t* masks) {
  const glm::ivec3 size = glm::min(grid.dims - first, glm::ivec3(edge));
  uint32_t voxels = 0;
  std::fill_n(masks, edge * edge, uint16_t(0));
  for (int z = 0; z < size.z; ++z) {
    for (int y = 0; y < size.y; ++y) {
      const uint16_t* row = grid.codes.data() + linearIndex(first + glm::ivec3(0, y, z), grid.dims);
      for (int x = 0; x < size.x; ++x) {
        if (stored[row[x]] == 0) continue;
        masks[y * edge + x] = uint16_t(masks[y * edge + x] | 1u << z);
        ++voxels;
      }
    }
  }
  return voxels;
}

}  // namespace

VoxLinkBuffers buildBuffers(const ValueGrid& grid, const std::vector<uint8_t>& stored, int brickEdge) {
  checkBrickEdge(brickEdge);
  checkEqual(uint64_t(grid.codes.size()), voxelCount(grid.dims), "codes of the grid");
  checkEqual(stored.size(), size_t(grid.coding.largest) + 1, "codes of the volume");
  glm::ivec3 low, high;
  fitBox(grid, stored, low, high);
  if (low.x >= high.x) throw nothingStored();
  VoxLinkBuffers buffers;
  buffers.dims = grid.dims;
  buffers.placement = grid.placement;
  buffers.grid = brickGrid(brickEdge, low, high);
  const BrickGrid& bricks = buffers.grid;
  const int64_t count = int64_t(bricks.bricks());

  std::vector<uint32_t> voxels(static_cast<size_t>(count));
#pragma omp parallel for schedule(dynamic, 64)
  for (int64_t at = 0; at < count; ++at) {
    std::array<uint16_t, 256> masks;
    voxels[size_t(at)] = columnMasks(grid, stored, bricks.position(uint64_t(at)) * brickEdge, brickEdge, masks.data());
  }

  buffers.brickWords.resize(size_t(count + 31) / 32);
  std::vector<uint32_t> firstFragment(static_cast<size_t>(count));
  uint64_t occupied = 0, fragments = 0;
  for (int64_t at = 0; at < count; ++at) {
    BrickWord& word = buffers.brickWords[size_t(at) >> 5];
    if ((at & 31) == 0) word = {0, uint32_t(occupied)};
    firstFragment[size_t(at)] = uint32_t(fragments);
    if (voxels[size_t(at)] == 0) continue;
    word.occupied |= 1u << (at & 31);
    ++occupied;
    fragments += voxels[size_t(at)];
  }
  checkFragmentCount(fragments);
  const size_t words = size_t(shared::headerWords(brickEdge));
  buffers.brickHeaders.resize(size_t(occupied) * words);
  buffers.fragments.resize(size_t(fragments));

  const glm::mat3 gradientMatrix(gradientFromDifferences(grid));
#pragma omp parallel for schedule(dynamic, 64)
  for (int64_t at = 0; at < count; ++at) {
    if (voxels[size_t(at)] == 0) continue;
    const glm::ivec3 brick = bricks.position(uint64_t(at));
    std::array<uint16_t, 256> masks;
    columnMasks(grid, stored, brick * brickEdge, brickEdge, masks.data());
    uint32_t* header = buffers.brickHeaders.data() + (buffers.header(brick) - buffers.brickHeaders.data());
    size_t fragment = firstFragment[size_t(at)];
    writeHeader(header, brickEdge, uint32_t(fragment), masks.data());
    for (int column = 0; column < brickEdge * brickEdge; ++column) {
      for (uint32_t mask = masks[size_t(column)]; mask != 0; mask &= mask - 1) {
        const glm::ivec3 voxel =
            brick * brickEdge + glm::ivec3(column % brickEdge, column / brickEdge, std::countr_zero(mask));
        const uint64_t voxelIndex = linearIndex(voxel, grid.dims);
        buffers.fragments[fragment++] =
            shared::fragmentOf(grid.codes[voxelIndex], voxelNormal(grid, gradientMatrix, voxel));
      }
    }
  }
  return buffers;
}

uint32_t voxelNormal(const ValueGrid& grid, const glm::mat3& gradientMatrix, glm::ivec3 voxel) {
  glm::vec3 perIndex(0.0f);
  for (int axis = 0; axis < 3; ++axis) {
    glm::ivec3 low = voxel, high = voxel;
    low[axis] = std::max(0, voxel[axis] - 1);
    high[axis] = std::min(grid.dims[axis] - 1, voxel[axis] + 1);
    if (low[axis] == high[axis]) continue;
    perIndex[axis] =
        (float(grid.codes[linearIndex(high, grid.dims)]) - float(grid.codes[linearIndex(low, grid.dims)])) *
        (high[axis] - low[axis] == 2 ? 0.5f : 1.0f);
  }
  const glm::vec3 gradient = gradientMatrix * perIndex;
  return shared::packNormal(gradient.x, gradient.y, gradient.z, kPerSurface);
}

InputError nothingStored() {
  return InputError(
      "VoxLink: no voxel is more opaque than the threshold, so there is nothing to trace; lower --threshold or give "
      "another transfer function");
}

void checkFragmentCount(uint64_t fragments) {
  if (fragments > UINT32_MAX) {
    throw InputError(fmt::format(
        "VoxLink: {} voxels would be stored, more than the {} that 32-bit lists can name; raise --threshold or lower "
        "--resolution",
        fragments, UINT32_MAX));
  }
}

}  // namespace freevoxel
