// Where sweeps put brick planes that nobody writes to a file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <utility>
#include <vector>

#include "precompute/hilbert.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"

namespace freevoxel {

inline constexpr int kBenchBrickEdge = 16;

/// All bricks of a volume in file order, each section's planes one after another.
class PlanesInMemory final : public AttenuationSink {
 public:
  PlanesInMemory(glm::ivec3 dims, uint8_t* memory) {
    const glm::ivec3 bricks = brickDims(dims, kBenchBrickEdge);
    const int order = brickCurveOrder(dims, kBenchBrickEdge);
    std::vector<std::pair<uint64_t, glm::ivec3>> sorted;
    for (int z = 0; z < bricks.z; ++z) {
      for (int y = 0; y < bricks.y; ++y) {
        for (int x = 0; x < bricks.x; ++x)
          sorted.emplace_back(hilbertIndex({x, y, z}, order), glm::ivec3(x, y, z));
      }
    }
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (auto& pass : slabs_) {
      pass.resize(size_t(bricks.z));
      for (const auto& [index, position] : sorted) {
        pass[size_t(position.z)].push_back({position, hilbertState(position, order), memory});
        memory += kDirectionsPerSection * kBenchBrickEdge * kBenchBrickEdge * kBenchBrickEdge;
      }
    }
  }
  std::span<const BrickPlanes> begin(int pass, int slab) override { return slabs_[size_t(pass)][size_t(slab)]; }
  void complete(int /*pass*/, int /*slab*/) override {}

 private:
  std::vector<std::vector<BrickPlanes>> slabs_[kSweepPasses];
};

}  // namespace freevoxel
