// Sparse volumes in per-voxel lists: the VoxLink buffer (papers/voxlink sections 3.1.3 and 4.1; docs/voxlink.md).
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/grid.h"
#include "base/light.h"
#include "base/placement.h"
#include "hierarchy/value_grid.h"
#include "shaders/shared/voxlink.h"
#include "volume/transfer_function.h"

namespace freevoxel {

using shared::BrickWord;
using shared::RayState;
using shared::VoxelMaterial;
static_assert(sizeof(BrickWord) == 8 && offsetof(BrickWord, rank) == 4);
static_assert(sizeof(VoxelMaterial) == 16 && offsetof(VoxelMaterial, extinction) == 12);
static_assert(sizeof(RayState) == 32 && offsetof(RayState, through) == 12 && offsetof(RayState, x) == 16 &&
              offsetof(RayState, t) == 28);

/// The grid of bricks that covers the stored voxels. Bricks are aligned to multiples of their edge.
struct BrickGrid {
  int edge = 8;                ///< voxels: 4, 8 or 16
  glm::ivec3 low{0}, high{0};  ///< box fitted to the stored voxels, in voxels; high exclusive
  glm::ivec3 first{0};         ///< brick that holds voxel low
  glm::ivec3 count{0};         ///< bricks along each axis

  uint64_t bricks() const { return voxelCount(count); }
  /// Of a brick in the grid, x fastest.
  uint64_t index(glm::ivec3 brick) const { return linearIndex(brick - first, count); }
  glm::ivec3 position(uint64_t index) const {
    return first + glm::ivec3(int(index % uint64_t(count.x)), int(index / uint64_t(count.x) % uint64_t(count.y)),
                              int(index / (uint64_t(count.x) * uint64_t(count.y))));
  }
};

/// The smallest grid round a box that is not empty. Throws InputError unless edge is 4, 8 or 16.
BrickGrid brickGrid(int edge, glm::ivec3 low, glm::ivec3 high);
/// Throws InputError unless edge is 4, 8 or 16.
void checkBrickEdge(int edge);

/// Of a brick's header (shaders/shared/voxlink.h): the filled voxels of a list.
inline uint32_t listMask(const uint32_t* header, int edge, int column) {
  return shared::listMask(header[shared::maskWord(column * edge)], edge, column);
}
/// Number of a stored voxel, told by its bit: those of the brick before it and of all bricks before.
inline size_t storedVoxel(const uint32_t* header, int edge, int bit) {
  const uint32_t start = header[shared::startWord(edge, bit)] >> shared::startShift(bit) & 0xffffu;
  const uint32_t word = header[shared::maskWord(bit)], other = (bit & 32) != 0 ? header[shared::maskWord(bit) - 1] : 0;
  const uint64_t below = uint64_t(word & ((1u << (bit & 31)) - 1u)) << 32 | other;
  return size_t(header[0]) + start + size_t(std::popcount(below));
}
/// Writes a brick's header from the masks of its edge^2 lists.
void writeHeader(uint32_t* header, int edge, uint32_t first, const uint16_t* masks);

/// Which voxels are filled, and where what they hold starts: stored voxels are counted in the order of headers, lists
/// and z.
/// Invariant: brickWords has one word per 32 bricks of the grid; brickHeaders has occupied bricks * headerWords(edge)
/// words in the order of the grid.
struct BrickLists {
  BrickGrid grid;
  std::vector<BrickWord> brickWords;
  std::vector<uint32_t> brickHeaders;

  uint64_t occupiedBricks() const { return brickHeaders.size() / size_t(shared::headerWords(grid.edge)); }
  uint64_t listBytes() const { return brickWords.size() * sizeof(BrickWord) + brickHeaders.size() * sizeof(uint32_t); }

  /// Header of the brick at a brick position inside the grid; null if it is empty.
  const uint32_t* header(glm::ivec3 brick) const {
    const uint64_t at = grid.index(brick);
    const BrickWord& word = brickWords[at >> 5];
    const uint32_t bit = uint32_t(at & 31u);
    if ((word.occupied >> bit & 1u) == 0) return nullptr;
    const uint32_t rank = word.rank + uint32_t(std::popcount(word.occupied & ((1u << bit) - 1u)));
    return brickHeaders.data() + size_t(rank) * size_t(shared::headerWords(grid.edge));
  }
  /// Number of the stored voxel at a place; nothing if none is.
  std::optional<size_t> stored(glm::ivec3 voxel) const;
};

/// A volume's voxels whose opacity is above a threshold.
struct VoxLinkBuffers : BrickLists {
  glm::ivec3 dims{0};  ///< of the volume
  Placement placement;
  std::vector<uint32_t> fragments;  ///< one per stored voxel

  /// Of all buffers, the materials for `codes` codes among them.
  uint64_t bytes(size_t codes) const {
    return listBytes() + fragments.size() * sizeof(uint32_t) + codes * sizeof(VoxelMaterial);
  }
  /// Fragment of a voxel of the volume; nothing if it is not stored.
  std::optional<uint32_t> find(glm::ivec3 voxel) const {
    const std::optional<size_t> at = stored(voxel);
    return at ? std::optional<uint32_t>(fragments[*at]) : std::nullopt;
  }
};

/// Per code: whether voxels of it are stored, which is whether their opacity (per reference length) is above the
/// threshold, 0 <= threshold < 1.
std::vector<uint8_t> storedCodes(const TransferFunction& transfer, const ValueCoding& coding, double threshold);

/// Colour and extinction of every code; those not stored are invisible.
std::vector<VoxelMaterial> voxelMaterials(const TransferFunction& transfer, const ValueCoding& coding,
                                          const std::vector<uint8_t>& stored);

/// Whether another set of stored codes needs other buffers: it has a code that occurs in the volume and is not in the
/// set that the buffers were built for.
bool needsRebuild(const ValueGrid& grid, const std::vector<uint8_t>& built, const std::vector<uint8_t>& wanted);

/// Plain C++: counts, then fills. `stored` has one entry per code. Same bytes for any thread count.
/// Throws InputError for a brick edge other than 4, 8, 16 and if nothing is stored.
VoxLinkBuffers buildBuffers(const ValueGrid& grid, const std::vector<uint8_t>& stored, int brickEdge);

/// As packNormal takes it.
inline constexpr float kPerSurface = 1.0f / (kSurfaceGradient * kSurfaceGradient);

/// The packed normal of a voxel (shared::packNormal): gradientAt's direction and strength. `gradientMatrix` is
/// gradientFromDifferences.
uint32_t voxelNormal(const ValueGrid& grid, const glm::mat3& gradientMatrix, glm::ivec3 voxel);

/// What to throw if no voxel is stored.
InputError nothingStored();
/// Throws InputError if so many fragments have no 32-bit index.
void checkFragmentCount(uint64_t fragments);

/// Calls f(fragment index, voxel) for every stored voxel, bricks in parallel.
template <class F>
void forEachStoredVoxel(const BrickLists& buffers, F&& f) {
  const BrickGrid& grid = buffers.grid;
#pragma omp parallel for schedule(dynamic, 64)
  for (int64_t at = 0; at < int64_t(grid.bricks()); ++at) {
    const glm::ivec3 brick = grid.position(uint64_t(at));
    const uint32_t* header = buffers.header(brick);
    if (header == nullptr) continue;
    size_t fragment = header[0];
    for (int column = 0; column < grid.edge * grid.edge; ++column) {
      for (uint32_t mask = listMask(header, grid.edge, column); mask != 0; mask &= mask - 1) {
        f(fragment++, brick * grid.edge + glm::ivec3(column % grid.edge, column / grid.edge, std::countr_zero(mask)));
      }
    }
  }
}

}  // namespace freevoxel
