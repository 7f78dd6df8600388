// From an opacity edit to the new picture, stage by stage, for a volume of bytes that is already open. Prints a
// Markdown table; arguments: edges of the volume, 256 if there are none. Threads as OMP_NUM_THREADS says.
#include <fmt/core.h>
#include <malloc.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "base/camera.h"
#include "bench/planes_in_memory.h"
#include "hierarchy/value_grid.h"
#include "precompute/segment_depth.h"
#include "precompute/sweep.h"
#include "shaders/shared/directions.h"
#include "splat/splat.h"
#include "splat/sums.h"
#include "volume/procedural.h"

namespace freevoxel {
namespace {

constexpr int kRuns = 7;

double secondsOf(const auto& f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Median and spread of what one stage took.
class Stage {
 public:
  void add(double seconds) { seconds_.push_back(seconds); }
  void print(const char* name) {
    std::sort(seconds_.begin(), seconds_.end());
    fmt::print("| {} | {:.1f} | {:.1f} | {:.1f} |\n", name, seconds_[seconds_.size() / 2] * 1e3, seconds_.front() * 1e3,
               seconds_.back() * 1e3);
  }

 private:
  std::vector<double> seconds_;
};

TransferFunction transferOf(double opacity) {
  TransferFunction transfer;
  transfer.points = {{0.0, {1.0, 1.0, 1.0}, 0.0}, {60.0, {0.4, 0.6, 1.0}, 0.0}, {255.0, {1.0, 0.8, 0.6}, opacity}};
  return transfer;
}

void measure(int edge) {
  const glm::ivec3 dims(edge);
  const Volume volume = generateVolume("cloud", dims);
  const ValueGrid grid = valueGrid(volume, transferOf(0.1));
  const Camera camera = orbitCamera(worldBounds(grid.placement, grid.dims), {0.7, 0.44, {}}, {1000, 1000}, 0.5236, {});
  std::vector<uint8_t> memory(voxelCount(brickDims(dims, kBenchBrickEdge)) * kBenchBrickEdge * kBenchBrickEdge *
                                  kBenchBrickEdge * shared::kDirectionCount +
                              kBrickPlaneAlignment);
  auto* const first =
      memory.data() +
      (kBrickPlaneAlignment - reinterpret_cast<uintptr_t>(memory.data()) % kBrickPlaneAlignment) % kBrickPlaneAlignment;
  PlanesInMemory sink(dims, first);
  StoredCodePlanes planes(grid.codes, dims);
  SweepMemory sweepMemory;
  for (const auto classification : {Classification::preintegrated, Classification::voxel}) {
    Stage table, sweep, attenuation, open, towardsEye, setup, draw, resolved;
    for (int run = 0; run < kRuns; ++run) {
      const TransferFunction edited = transferOf(0.1 + 0.02 * run);
      std::unique_ptr<SegmentDepth> segments;
      const double tableSeconds = secondsOf([&] { segments = makeSegmentDepth(classification, edited, grid.coding); });
      const double sweepSeconds =
          secondsOf([&] { sweepAttenuation(planes, dims, kBenchBrickEdge, *segments, sink, 3, sweepMemory); });
      table.add(tableSeconds);
      sweep.add(sweepSeconds);
      attenuation.add(tableSeconds + sweepSeconds);
      if (classification != Classification::preintegrated) continue;
      std::optional<Splatter> splatter;
      open.add(secondsOf([&] { splatter.emplace(grid, nullptr, edited, Backend::cpu); }));
      SplatOptions options;
      options.attenuation = AttenuationSource::swept;
      const SplatResult result = splatter->render(camera, options, silentProgress());
      towardsEye.add(result.statistics.attenuationSeconds);
      setup.add(result.statistics.setupSeconds);
      draw.add(result.statistics.drawSeconds);
      resolved.add(secondsOf([&] { resolve(result.sums, options.formula); }));
    }
    fmt::print("\n{}^3, {} threads, {}\n\n", edge, omp_get_max_threads(), classificationName(classification));
    fmt::print("| stage | median, ms | least | most |\n|---|---:|---:|---:|\n");
    table.print("segment tables");
    sweep.print("sweep of 26 directions, coded into brick planes");
    attenuation.print("**both: the attenuation stage**");
    if (classification != Classification::preintegrated) continue;
    towardsEye.print("instead of these: a sweep towards the eye alone");
    open.print("tables of opacity and colour, blocks with something visible");
    setup.print("blocks of the view");
    draw.print("splats, 1000 x 1000, cells, on the CPU");
    resolved.print("resolve");
  }
}

}  // namespace
}  // namespace freevoxel

int main(int argc, char** argv) {
  // A program that keeps a volume open keeps its memory too. What goes back to the system is not only slow to come by
  // again: on a virtual machine that reports free pages to its host, memory is slow for whatever runs next.
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
  for (int i = 1; i < argc; ++i)
    freevoxel::measure(std::clamp(std::atoi(argv[i]), 8, 1024));
  if (argc == 1) freevoxel::measure(256);
  return 0;
}
