// How fast all 26 directions are swept into brick planes in memory, beside what the memory takes at all in the same
// run. Prints a Markdown table; arguments: edges of the volume, 128 256 512 if there are none.
#include <emmintrin.h>
#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "bench/planes_in_memory.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
#include "shaders/shared/directions.h"

namespace freevoxel {
namespace {

constexpr int kRuns = 5;
constexpr size_t kPageBytesTouched = 4096;

double secondsOf(const auto& f) {
  const auto start = std::chrono::steady_clock::now();
  f();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Pages that nobody has touched.
struct Buffer {
  explicit Buffer(size_t count)
      : bytes((count + kPageBytesTouched - 1) / kPageBytesTouched * kPageBytesTouched),
        memory(static_cast<uint8_t*>(std::aligned_alloc(kPageBytesTouched, bytes)), &std::free) {
    if (!memory) std::abort();
  }
  size_t bytes;
  std::unique_ptr<uint8_t, decltype(&std::free)> memory;

  /// Calls f(first, bytes) with one share for each thread, whole pages.
  template <class F>
  double gigabytesPerSecond(F&& f) const {
    const double seconds = secondsOf([&] {
#pragma omp parallel
      {
        const size_t pages = bytes / kPageBytesTouched, threads = size_t(omp_get_num_threads());
        const size_t begin = pages * size_t(omp_get_thread_num()) / threads * kPageBytesTouched;
        const size_t end = pages * size_t(omp_get_thread_num() + 1) / threads * kPageBytesTouched;
        f(memory.get() + begin, end - begin);
      }
    });
    return double(bytes) / seconds * 1e-9;
  }
};

void streamZeros(uint8_t* first, size_t bytes) {
  for (size_t i = 0; i < bytes; i += sizeof(__m128i))
    _mm_stream_si128(reinterpret_cast<__m128i*>(first + i), _mm_setzero_si128());
  _mm_sfence();
}

struct Field {
  const char* name;
  std::vector<uint16_t> (*codes)(int edge);
};

/// Every voxel independent of its neighbours: nothing to skip, no look-up near the one before.
std::vector<uint16_t> noise(int edge) {
  std::mt19937 random(1);
  std::vector<uint16_t> codes(size_t(edge) * size_t(edge) * size_t(edge));
  for (uint16_t& code : codes)
    code = uint16_t(random() & 255);
  return codes;
}

/// A soft ball in nothing.
std::vector<uint16_t> ball(int edge) {
  std::vector<uint16_t> codes(size_t(edge) * size_t(edge) * size_t(edge));
  const auto square = [&](int i) { return (2.0 * i / edge - 1.0) * (2.0 * i / edge - 1.0); };
#pragma omp parallel for
  for (int z = 0; z < edge; ++z) {
    for (int y = 0; y < edge; ++y) {
      for (int x = 0; x < edge; ++x) {
        const double value = 255.0 * (1.0 - (square(x) + square(y) + square(z)));
        codes[(size_t(z) * size_t(edge) + size_t(y)) * size_t(edge) + size_t(x)] = uint16_t(std::max(value, 0.0));
      }
    }
  }
  return codes;
}

/// A row of the table, and its figures.
void measure(int edge, const Field& field, Classification classification, int threads) {
  omp_set_num_threads(threads);
  const glm::ivec3 dims(edge);
  const std::vector<uint16_t> codes = field.codes(edge);
  const glm::ivec3 bricks = brickDims(dims, kBenchBrickEdge);
  const Buffer buffer(voxelCount(bricks) * kBenchBrickEdge * kBenchBrickEdge * kBenchBrickEdge *
                      shared::kDirectionCount);
  const auto set = [](uint8_t* first, size_t bytes) { std::memset(first, 1, bytes); };
  const double firstTouch = buffer.gigabytesPerSecond(set);

  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}, {255.0, {}, 0.05}};
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  std::vector<double> tables, sweeps, memsets, streams;
  PlanesInMemory sink(dims, buffer.memory.get());
  StoredCodePlanes planes(codes, dims);
  SweepMemory memory;
  for (int run = 0; run < kRuns; ++run) {
    std::unique_ptr<SegmentDepth> segments;
    tables.push_back(secondsOf([&] { segments = makeSegmentDepth(classification, transfer, coding); }));
    sweeps.push_back(secondsOf([&] { sweepAttenuation(planes, dims, kBenchBrickEdge, *segments, sink, 3, memory); }));
    memsets.push_back(buffer.gigabytesPerSecond(set));
    streams.push_back(buffer.gigabytesPerSecond(streamZeros));
  }
  const double seconds = median(sweeps);
  const double rate = double(voxelCount(dims)) * shared::kDirectionCount / seconds * 1e-9;
  fmt::print(
      "| {}^3 | {} | {} | {} | {:.1f} | {:.1f} | {:.0f} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {:.1f} |\n",
      edge, field.name, classificationName(classification), threads, median(tables) * 1e3, seconds * 1e3,
      double(voxelCount(dims)) / seconds * 1e-6, rate, rate / median(memsets), rate / median(streams), median(memsets),
      median(streams), firstTouch);
  std::fflush(stdout);
}

}  // namespace
}  // namespace freevoxel

int main(int argc, char** argv) {
  using namespace freevoxel;
  std::vector<int> edges;
  for (int i = 1; i < argc; ++i)
    edges.push_back(std::clamp(std::atoi(argv[i]), 1, 2048));
  if (edges.empty()) edges = {128, 256, 512};
  fmt::print(
      "| volume | field | classification | threads | segment table, ms | sweep, ms | Mvoxel/s | GB/s | of memset | of "
      "streaming stores | memset, GB/s | streaming, GB/s | first touch, GB/s |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const int edge : edges) {
    for (const Field& field : {Field{"noise", noise}, Field{"ball", ball}}) {
      for (const auto classification : {Classification::voxel, Classification::preintegrated}) {
        for (const int threads : {1, 2})
          measure(edge, field, classification, threads);
      }
    }
  }
  return 0;
}
