// Writing attenuation files: what is promised about the file as a whole. Contents are read back in tests/hierarchy.
#include "precompute/precompute.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "base/error.h"
#include "tests/precompute/test_volumes.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

/// Counts what it is told.
struct CountingProgress : Progress {
  uint64_t total = 0, advanced = 0;
  int begun = 0, ended = 0;
  void begin(const std::string&, uint64_t steps, const std::string&) override {
    ++begun;
    total += steps;
  }
  void advance(uint64_t steps) override { advanced += steps; }
  void end() override { ++ended; }
};

TEST(Precompute, sameBytesForAnyNumberOfThreads) {
  const Volume volume = test::randomBytes({17, 25, 33}, 21);
  const std::string folder = test::temporaryFolder();
  const int before = omp_get_max_threads();
  for (const auto& [classification, layout] :
       {std::pair(Classification::voxel, Layout::dense), std::pair(Classification::preintegrated, Layout::dense),
        std::pair(Classification::preintegrated, Layout::compact)}) {
    std::string expected;
    for (const int threads : {1, 2, 3, 8}) {
      omp_set_num_threads(threads);
      PrecomputeOptions options;
      options.classification = classification;
      options.layout = layout;
      options.brickEdge = 8;
      precompute(volume, test::veilAndRamp(), folder + "/a.fvx", options, test::silentProgress());
      const std::string bytes = test::readBytes(folder + "/a.fvx");
      if (threads == 1) expected = bytes;
      EXPECT_TRUE(bytes == expected) << threads << " threads";
    }
  }
  omp_set_num_threads(before);
}

/// A volume in memory, read slice by slice.
class MemorySource final : public VolumeSource {
 public:
  explicit MemorySource(const Volume& volume) : volume_(volume) {}
  const VolumeHeader& header() const override { return volume_.header; }
  void readSlices(int count, std::span<std::byte> out) override {
    ASSERT_EQ(out.size(), volume_.header.bytes() / uint64_t(volume_.header.dims.z) * uint64_t(count));
    std::copy_n(volume_.data.begin() + ptrdiff_t(read_), out.size(), out.begin());
    read_ += out.size();
  }

 private:
  const Volume& volume_;
  size_t read_ = 0;
};

struct LimitCase {
  glm::ivec3 dims;
  int edge;
  ValueType type;
};
class MemoryLimit : public testing::TestWithParam<LimitCase> {};
INSTANTIATE_TEST_SUITE_P(
    Dims, MemoryLimit,
    testing::Values(LimitCase{{5, 7, 11}, 8, ValueType::u8}, LimitCase{{33, 17, 50}, 8, ValueType::u8},
                    LimitCase{{20, 41, 16}, 16, ValueType::f32}, LimitCase{{19, 3, 33}, 16, ValueType::u8},
                    LimitCase{{40, 9, 70}, 32, ValueType::f32}, LimitCase{{1, 1, 1}, 8, ValueType::u8}));

/// The least memory that an error asks for.
uint64_t leastMemory(const Volume& volume, const TransferFunction& transfer, const std::string& path,
                     PrecomputeOptions options) {
  for (options.memoryBytes = 1;;) {
    MemorySource source(volume);
    try {
      precompute(source, transfer, path, options, test::silentProgress());
      return options.memoryBytes;
    } catch (const MachineError& error) {
      const std::string text = error.what();
      const size_t at = text.find(" need ");
      if (at == std::string::npos) throw;
      const uint64_t needed = std::stoull(text.substr(at + 6));
      if (needed <= options.memoryBytes) throw;
      options.memoryBytes = needed;
    }
  }
}

TEST_P(MemoryLimit, doesNotChangeTheBytes) {
  const auto [dims, edge, type] = GetParam();
  const Volume volume = type == ValueType::u8 ? test::randomBytes(dims, 31)
                                              : test::makeVolume<float>(type, dims, [](int x, int y, int z) {
                                                  return float((x * 37 + y * 11 + z * 23) % 256) + 0.3f;
                                                });
  const std::string folder = test::temporaryFolder();
  PrecomputeOptions options;
  options.brickEdge = edge;
  const auto expectedResult =
      precompute(volume, test::veilAndRamp(), folder + "/whole.fvx", options, test::silentProgress());
  const std::string expected = test::readBytes(folder + "/whole.fvx");
  const uint64_t least = leastMemory(volume, test::veilAndRamp(), folder + "/limited.fvx", options);
  EXPECT_TRUE(test::readBytes(folder + "/limited.fvx") == expected);
  for (const uint64_t limit : {uint64_t(0), least * 2, least * 100}) {
    options.memoryBytes = limit;
    MemorySource source(volume);
    const auto result =
        precompute(source, test::veilAndRamp(), folder + "/limited.fvx", options, test::silentProgress());
    EXPECT_TRUE(test::readBytes(folder + "/limited.fvx") == expected) << limit;
    EXPECT_EQ(result.largestValueError, expectedResult.largestValueError);
    EXPECT_EQ(result.visibleVoxels, expectedResult.visibleVoxels);
  }
  EXPECT_EQ(test::listFolder(folder).size(), 2u);
}

TEST(Precompute, reportsItsFiguresAndProgress) {
  const Volume volume = test::randomBytes({5, 7, 11}, 22);
  const std::string folder = test::temporaryFolder();
  CountingProgress progress;
  const auto result = precompute(volume, test::veilAndRamp(), folder + "/a.fvx", {}, progress);
  EXPECT_EQ(result.voxels, 385u);
  EXPECT_EQ(result.bricks, 1u);
  EXPECT_EQ(result.storedVoxels, 385u);
  uint64_t visible = 0;
  for (uint64_t i = 0; i < 385; ++i)
    visible += test::veilAndRamp().opacityAt(volume.value(i)) > 0.0 ? 1 : 0;
  EXPECT_EQ(result.visibleVoxels, visible);
  EXPECT_EQ(result.fileBytes, test::readBytes(folder + "/a.fvx").size());
  EXPECT_EQ(result.nonFinite, 0u);
  EXPECT_EQ(result.largestValueError, 0.0);
  EXPECT_EQ(progress.begun, 1);
  EXPECT_EQ(progress.ended, 1);
  EXPECT_EQ(progress.total, 385u * 26u);
  EXPECT_EQ(progress.advanced, progress.total);
}

TEST(Precompute, statesTheLossOfFloatValuesAndCountsNonFiniteOnes) {
  const Volume volume = test::makeVolume<float>(ValueType::f32, {5, 7, 11}, [](int x, int y, int z) {
    if (x == 1 && y == 2 && z == 3) return std::numeric_limits<float>::quiet_NaN();
    if (x == 2 && y == 2 && z == 3) return std::numeric_limits<float>::infinity();
    return float(x) * 0.1f + float(y) * 0.013f - float(z) * 0.05f;
  });
  const TransferFunction transfer = test::veilAndRamp(-0.5, 0.5);
  const std::string path = test::temporaryFolder() + "/a.fvx";
  const auto result = precompute(volume, transfer, path, {}, test::silentProgress());
  EXPECT_EQ(result.nonFinite, 2u);
  EXPECT_GT(result.largestValueError, 0.0);
  EXPECT_LE(result.largestValueError, 0.5 / 65535 * 1.0000001);
}

TEST(Precompute, nothingVisibleStillMakesAFile) {
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}};
  const std::string path = test::temporaryFolder() + "/a.fvx";
  const auto result = precompute(test::randomBytes({5, 7, 11}, 1), transfer, path, {}, test::silentProgress());
  EXPECT_EQ(result.bricks, 0u);
  EXPECT_EQ(result.storedVoxels, 0u);
}

TEST(Precompute, refusesWhatItCannotWrite) {
  const Volume volume = test::randomBytes({5, 7, 11}, 1);
  const std::string folder = test::temporaryFolder();
  const auto attempt = [&](const std::string& path, const PrecomputeOptions& options) {
    precompute(volume, test::veilAndRamp(), path, options, test::silentProgress());
  };
  PrecomputeOptions options;
  options.brickEdge = 12;
  EXPECT_THROW(attempt(folder + "/a.fvx", options), InputError);
  EXPECT_THROW(attempt(folder + "/missing/a.fvx", {}), MachineError);
  EXPECT_TRUE(test::listFolder(folder).empty());
}

}  // namespace
}  // namespace freevoxel
