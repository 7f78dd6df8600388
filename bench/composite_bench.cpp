// The composite against one MPI_Reduce of whole images, run under mpirun: interleaved, the sums compared bit by bit
// first.
#include <fmt/core.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <climits>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
#include <vector>

#include "parallel/composite.h"

namespace freevoxel {
namespace {

constexpr int kChannels = 6;
const std::array<float, kChannels> kLimits = {16.0f, 16.0f, 16.0f, 16.0f, 0x1p18f, 0x1p8f};

/// What a rank of several draws: patches the size of a block's picture scattered over the share of the image that
/// `cover` names, a disc round its centre; 1 covers everything.
Image drawnBy(int rank, int rankCount, glm::ivec2 size, double cover) {
  Image image(size, kChannels);
  constexpr int kPatch = 60;
  std::mt19937 random(1234u + unsigned(rank));
  const auto fill = [&](int x, int y) {
    float* pixel = image.at(x, y);
    for (int c = 0; c < kChannels; ++c)
      pixel[c] = float(random() % 1000003) * 0x1p-20f;
  };
  if (cover >= 1.0) {
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x)
        fill(x, y);
    }
    return image;
  }
  const double radius = std::sqrt(cover * double(size.x) * double(size.y) / 3.14159265358979);
  // Blocks lie behind each other: eight to a place, dealt to the ranks.
  const int patches = std::max(1, int(8.0 * cover * double(size.x) * double(size.y) / (kPatch * kPatch) / rankCount));
  for (int i = 0; i < patches; ++i) {
    const double angle = 6.2831853 * double(random() % 65536) / 65536.0;
    const double r = radius * std::sqrt(double(random() % 65536) / 65536.0);
    const int x0 = int(size.x / 2 + r * std::cos(angle)), y0 = int(size.y / 2 + r * std::sin(angle));
    for (int y = std::max(0, y0 - kPatch / 2); y < std::min(size.y, y0 + kPatch / 2); ++y) {
      for (int x = std::max(0, x0 - kPatch / 2); x < std::min(size.x, x0 + kPatch / 2); ++x)
        fill(x, y);
    }
  }
  return image;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

int run(int argc, char** argv) {
  // MPI_Reduce takes memory of the size of the image at every call: as a rule from the system, page by page, which can
  // cost more than all else it does. Here it keeps what it has had, so that it is at its fastest.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
  const Ranks ranks(argc, argv);
  CLI::App program("Medians of interleaved runs: the composite of covered tiles, and MPI_Reduce.");
  int width = 1000, height = 1000, runs = 20;
  size_t slice = kCompositeSlice;
  double cover = 0.4;
  program.add_option("--width", width, "pixels");
  program.add_option("--height", height, "pixels");
  program.add_option("--runs", runs, "of each");
  program.add_option("--cover", cover, "share of the image in which there is anything, up to 1");
  program.add_option("--slice", slice, "pixels that are added at a time");
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error);
  }
  const glm::ivec2 size(width, height);
  const Image drawn = drawnBy(ranks.rank(), ranks.rankCount(), size, cover);
  Compositor compositor(ranks, size, kChannels, slice);
  Image tiles = drawn, reduced = drawn;
  compositor.add(tiles, kLimits);
  addByReduce(ranks, reduced, kLimits);
  const uint64_t sent = compositor.traffic().sentBytes;
  if (ranks.isRoot() &&
      std::memcmp(tiles.pixels.data(), reduced.pixels.data(), tiles.pixels.size() * sizeof(float)) != 0) {
    fmt::print(stderr, "composite: the sums differ\n");
    MPI_Abort(ranks.communicator(), 1);
  }
  std::vector<double> seconds[2];
  const auto timed = [&](int which) {
    std::copy(drawn.pixels.begin(), drawn.pixels.end(), tiles.pixels.begin());
    MPI_Barrier(ranks.communicator());
    const auto start = std::chrono::steady_clock::now();
    if (which == 0) {
      compositor.add(tiles, kLimits);
    } else {
      addByReduce(ranks, tiles, kLimits);
    }
    seconds[which].push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  };
  for (int i = 0; i < runs; ++i) {
    timed(i % 2);
    timed(1 - i % 2);
  }
  std::vector<unsigned long long> sentBy(size_t(ranks.rankCount()));
  const unsigned long long mine = sent;
  MPI_Allgather(&mine, 1, MPI_UNSIGNED_LONG_LONG, sentBy.data(), 1, MPI_UNSIGNED_LONG_LONG, ranks.communicator());
  if (!ranks.isRoot()) return 0;
  const double a = median(seconds[0]), b = median(seconds[1]);
  fmt::print("| {} | {}x{} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", ranks.rankCount(), width, height,
             cover, 1e3 * a, 1e3 * b, a / b, 1e-6 * double(*std::max_element(sentBy.begin(), sentBy.end())),
             1e-6 * double(drawn.pixels.size() * sizeof(float)));
  return 0;
}

}  // namespace
}  // namespace freevoxel

int main(int argc, char** argv) {
  return freevoxel::run(argc, argv);
}
