// What the reader gives back is what was precomputed, voxel by voxel.
#include "hierarchy/attenuation_file.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>

#include "base/error.h"
#include "precompute/precompute.h"
#include "precompute/stored_bricks.h"
#include "precompute/sweep.h"
#include "shaders/shared/directions.h"
#include "tests/precompute/test_volumes.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

/// A volume with its transfer function, coded and swept in volume order.
struct Expected {
  Volume volume;
  TransferFunction transfer;
  PrecomputeOptions options;
  ValueCoding coding;
  std::vector<uint16_t> codes;
  test::Planes planes;
};

Expected expected(Volume volume, const TransferFunction& transfer, const PrecomputeOptions& options) {
  Expected result{std::move(volume), transfer, options, {}, {}, {}};
  const glm::ivec3 dims = result.volume.header.dims;
  result.coding = valueCoding(result.volume.header.type, transfer.low, transfer.high);
  result.codes = encodeValues(result.volume, result.coding);
  const auto segments = makeSegmentDepth(options.classification, transfer, result.coding);
  result.planes = test::sweepAll(result.codes, dims, *segments);
  return result;
}

/// Attenuation regenerated from faces may be one code off.
void expectBrick(const Expected& e, const BrickView& brick) {
  const int tolerance = e.options.layout == Layout::compact ? 1 : 0;
  const glm::ivec3 dims = e.volume.header.dims;
  const auto count = size_t(brick.edge) * size_t(brick.edge) * size_t(brick.edge);
  ASSERT_EQ(brick.curve.size(), count);
  uint32_t visible = 0;
  for (size_t step = 0; step < count; ++step) {
    const LocalPosition local = brick.curve[step];
    ASSERT_EQ(brick.steps[size_t(local.x) + size_t(brick.edge) * (local.y + size_t(brick.edge) * local.z)], step);
    const glm::ivec3 p = brick.origin + glm::ivec3(local.x, local.y, local.z);
    if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) {
      ASSERT_EQ(brick.code(step), 0u);
      for (const uint8_t* plane : brick.attenuations)
        ASSERT_EQ(plane[step], 255);
      continue;
    }
    const uint64_t i = linearIndex(p, dims);
    ASSERT_EQ(brick.code(step), e.codes[i]);
    for (size_t k = 0; k < e.planes.size(); ++k)
      ASSERT_LE(std::abs(int(brick.attenuations[k][step]) - int(e.planes[k][i])), tolerance) << "direction " << k;
    visible += e.transfer.opacityAt(e.coding.decode(e.codes[i])) > 0.0 ? 1 : 0;
  }
  ASSERT_EQ(brick.visibleVoxels, visible);
}

void expectFile(const Expected& e, const AttenuationFile& file) {
  const VolumeHeader& header = e.volume.header;
  EXPECT_EQ(file.dims(), header.dims);
  EXPECT_EQ(file.placement().spacing, header.placement.spacing);
  EXPECT_EQ(file.placement().origin, header.placement.origin);
  EXPECT_EQ(file.placement().direction, header.placement.direction);
  EXPECT_EQ(file.coding().low, e.coding.low);
  EXPECT_EQ(file.coding().step, e.coding.step);
  EXPECT_EQ(file.coding().largest, e.coding.largest);
  EXPECT_EQ(file.classification(), e.options.classification);
  EXPECT_EQ(file.layout(), e.options.layout);
  EXPECT_EQ(file.brickEdge(), e.options.brickEdge);
  EXPECT_EQ(file.command(), e.options.command);
  EXPECT_EQ(file.transfer().points.size(), e.transfer.points.size());
  EXPECT_EQ(opacityHash(file.transfer()), opacityHash(e.transfer));
  const auto stored = findStoredBricks(e.codes, header.dims, e.options.brickEdge, e.transfer, e.coding);
  ASSERT_EQ(file.brickCount(), stored.size());
  for (size_t i = 0; i < stored.size(); ++i) {
    const BrickView brick = file.brick(i);
    ASSERT_EQ(brick.hilbertIndex, stored[i].hilbertIndex);
    ASSERT_EQ(brick.origin, stored[i].position * e.options.brickEdge);
    ASSERT_EQ(file.findBrick(stored[i].position), i);
    expectBrick(e, brick);
    file.verifyBrick(i);
  }
  file.verify();
}

void roundTripOnce(const Volume& volume, const TransferFunction& transfer, const PrecomputeOptions& options) {
  const Expected e = expected(volume, transfer, options);
  const std::string path = test::temporaryFolder() + "/a.fvx";
  const auto result = precompute(volume, transfer, path, options, test::silentProgress());
  const AttenuationFile file(path);
  expectFile(e, file);
  EXPECT_EQ(file.storedVoxels(), result.storedVoxels);
  EXPECT_EQ(file.visibleVoxels(), result.visibleVoxels);
  EXPECT_EQ(file.nonFinite(), result.nonFinite);
  EXPECT_EQ(file.largestValueError(), result.largestValueError);
  EXPECT_EQ(file.fileBytes(), result.fileBytes);
}

/// In both layouts.
void roundTrip(const Volume& volume, const TransferFunction& transfer, PrecomputeOptions options) {
  roundTripOnce(volume, transfer, options);
  options.layout = Layout::compact;
  roundTripOnce(volume, transfer, options);
}

class RoundTrip : public testing::TestWithParam<glm::ivec3> {};
INSTANTIATE_TEST_SUITE_P(Dims, RoundTrip,
                         testing::Values(glm::ivec3(1, 1, 1), glm::ivec3(5, 7, 11), glm::ivec3(17, 3, 33),
                                         glm::ivec3(16, 16, 17), glm::ivec3(9, 40, 24)));

TEST_P(RoundTrip, bytes) {
  for (const int edge : {8, 16, 32}) {
    roundTrip(test::randomBytes(GetParam(), 31), test::veilAndRamp(),
              {Classification::voxel, Layout::dense, edge, "freevoxel precompute a b"});
  }
}

TEST_P(RoundTrip, preintegrated) {
  for (const int edge : {8, 32}) {
    roundTrip(test::randomBytes(GetParam(), 32), test::veilAndRamp(),
              {Classification::preintegrated, Layout::dense, edge, ""});
  }
}

/// Light gets far through veils, so that a way through a brick has many segments that all count.
TEST_P(RoundTrip, veils) {
  const Volume volume = test::makeVolume<uint16_t>(ValueType::u16, GetParam(), [](int x, int y, int z) {
    return uint16_t(2000.0 + 1500.0 * std::sin(0.3 * x) * std::cos(0.2 * y + 0.1 * z));
  });
  TransferFunction transfer;
  transfer.high = 4095.0;
  transfer.points = {{0.0, {}, 0.0}, {2000.0, {}, 0.01}, {2000.0, {}, 0.03}, {4095.0, {}, 0.08}};
  for (const auto classification : {Classification::voxel, Classification::preintegrated}) {
    for (const int edge : {16, 32})
      roundTrip(volume, transfer, {classification, Layout::dense, edge, ""});
  }
}

TEST_P(RoundTrip, shorts) {
  std::mt19937 random(33);
  const Volume volume = test::makeVolume<uint16_t>(
      ValueType::u16, GetParam(), [&](int, int, int) { return uint16_t(random() % 2 == 0 ? random() % 4096 : 0); });
  for (const auto classification : {Classification::voxel, Classification::preintegrated}) {
    roundTrip(volume, test::veilAndRamp(0.0, 3000.0), {classification, Layout::dense, 16, ""});
  }
}

TEST_P(RoundTrip, floatsWithNonFiniteValues) {
  std::mt19937 random(34);
  const Volume volume = test::makeVolume<float>(ValueType::f32, GetParam(), [&](int x, int y, int) {
    if (x == 0 && y == 0) return std::numeric_limits<float>::quiet_NaN();
    if (x == 2 && y == 1) return std::numeric_limits<float>::infinity();
    if (x == 3 && y == 1) return -std::numeric_limits<float>::infinity();
    return float(random() % 1000) * 0.003f - 1.0f;
  });
  roundTrip(volume, test::veilAndRamp(-1.0, 2.5), {Classification::voxel, Layout::dense, 8, ""});
}

/// A compact file of several bricks, some of them cut off by the volume's border.
AttenuationFile compactFile() {
  const std::string path = test::temporaryFolder() + "/a.fvx";
  precompute(test::randomBytes({21, 17, 40}, 38), test::veilAndRamp(), path,
             {Classification::preintegrated, Layout::compact, 16, ""}, test::silentProgress());
  return AttenuationFile(path);
}

TEST(CompactLayout, unpacksOnlyWhatIsAskedFor) {
  const AttenuationFile file = compactFile();
  const size_t planeBytes = 16 * 16 * 16;
  for (size_t i = 0; i < file.brickCount(); ++i) {
    const BrickView all = file.brick(i);
    const BrickView none = file.brick(i, DirectionSet(0));
    ASSERT_EQ(std::memcmp(none.codes, all.codes, planeBytes), 0);
    for (int k = 0; k < shared::kDirectionCount; ++k) {
      ASSERT_EQ(none.attenuations[k], nullptr);
      const BrickView one = file.brick(i, DirectionSet(1) << k);
      ASSERT_EQ(one.attenuations[(k + 1) % shared::kDirectionCount], nullptr);
      ASSERT_EQ(std::memcmp(one.attenuations[k], all.attenuations[k], planeBytes), 0) << "direction " << k;
    }
  }
}

TEST(CompactLayout, isSmallerAndCountsWhatItTakes) {
  const AttenuationFile file = compactFile();
  EXPECT_GT(file.attenuationBytes(), file.brickCount() * 10);
  EXPECT_LT(file.attenuationBytes(), file.brickCount() * 2 * (6628 + 64));
  EXPECT_LT(file.codeBytes(), file.brickCount() * (4096 + 64));
  EXPECT_LT(file.codeBytes() + file.attenuationBytes(), file.fileBytes());
}

TEST(CompactLayout, bricksAreUnpackedFromManyThreadsAtOnce) {
  const AttenuationFile file = compactFile();
  std::vector<BrickView> alone;
  for (size_t i = 0; i < file.brickCount(); ++i)
    alone.push_back(file.brick(i));
  int different = 0;
#pragma omp parallel for num_threads(4) reduction(+ : different)
  for (size_t n = 0; n < 20 * file.brickCount(); ++n) {
    const size_t i = n % file.brickCount();
    const BrickView brick = file.brick(i);
    for (int k = 0; k < shared::kDirectionCount; ++k)
      different += std::memcmp(brick.attenuations[k], alone[i].attenuations[k], 4096) != 0 ? 1 : 0;
  }
  EXPECT_EQ(different, 0);
}

TEST(AttenuationFile, absentBricksAreNotFound) {
  const glm::ivec3 dims(40, 9, 17);
  const Volume volume = test::makeVolume<uint8_t>(
      ValueType::u8, dims, [](int x, int y, int z) { return uint8_t(x == 20 && y == 4 && z == 12 ? 255 : 0); });
  const std::string path = test::temporaryFolder() + "/a.fvx";
  precompute(volume, test::veilAndRamp(), path, {Classification::voxel, Layout::dense, 8, ""}, test::silentProgress());
  const AttenuationFile file(path);
  EXPECT_EQ(file.brickCount(), 1u);
  EXPECT_EQ(file.findBrick({2, 0, 1}), size_t(0));
  EXPECT_EQ(file.findBrick({1, 0, 1}), std::nullopt);
  EXPECT_EQ(file.findBrick({-1, 0, 0}), std::nullopt);
  EXPECT_EQ(file.findBrick({5, 0, 0}), std::nullopt);
  EXPECT_EQ(file.findBrick({1 << 20, 0, 0}), std::nullopt);
}

TEST(AttenuationFile, holdsNoBricksWhereNothingIsVisible) {
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}};
  roundTrip(test::randomBytes({5, 7, 11}, 35), transfer, {Classification::voxel, Layout::dense, 16, ""});
}

TEST(AttenuationFile, canBeMoved) {
  const std::string path = test::temporaryFolder() + "/a.fvx";
  precompute(test::randomBytes({5, 7, 11}, 36), test::veilAndRamp(), path, {}, test::silentProgress());
  AttenuationFile file(path);
  const uint32_t first = file.brick(0).code(0);
  const AttenuationFile moved(std::move(file));
  EXPECT_EQ(moved.brick(0).code(0), first);
  moved.verify();
}

/// The file as docs/format.md draws it, without the structs that write and read it.
TEST(AttenuationFile, liesInTheFileAsDrawn) {
  const std::string path = test::temporaryFolder() + "/a.fvx";
  const Expected e = expected(test::randomBytes({5, 7, 11}, 37), test::veilAndRamp(),
                              {Classification::voxel, Layout::dense, 8, "made by a test"});
  precompute(e.volume, e.transfer, path, e.options, test::silentProgress());
  const std::string bytes = test::readBytes(path);
  const auto number = [&](size_t offset, size_t size) {
    uint64_t value = 0;
    for (size_t i = size; i-- > 0;)
      value = value << 8 | uint8_t(bytes[offset + i]);
    return value;
  };
  EXPECT_EQ(bytes.substr(0, 8),
            "\x89"
            "FVX\r\n\x1a\n");
  EXPECT_EQ(number(8, 4), 1u);
  EXPECT_EQ(number(16, 8), bytes.size());
  std::map<std::string, size_t> offsets;
  std::map<std::string, uint64_t> items;
  for (size_t i = 0; i < number(12, 4); ++i) {
    const std::string type = bytes.substr(32 + 40 * i, 4);
    offsets[type] = number(32 + 40 * i + 8, 8);
    items[type] = number(32 + 40 * i + 24, 8);
  }
  const size_t metadata = offsets.at("META");
  EXPECT_EQ(number(metadata, 4), 5u);
  EXPECT_EQ(number(metadata + 4, 4), 7u);
  EXPECT_EQ(number(metadata + 8, 4), 11u);
  EXPECT_EQ(number(metadata + 12, 4), 8u);
  double spacingY = 0.0;
  std::memcpy(&spacingY, bytes.data() + metadata + 24, sizeof(double));
  EXPECT_EQ(spacingY, 1.25);
  EXPECT_EQ(number(metadata + 160, 4), 255u);
  EXPECT_EQ(number(metadata + 184, 8), 385u);
  EXPECT_EQ(bytes.substr(offsets.at("CMND"), items.at("CMND")), "made by a test");
  EXPECT_EQ(bytes[offsets.at("DIRS") + 3 * 13], char(1));  // direction 13 is +x
  ASSERT_EQ(items.at("BRIK"), 2u);
  for (size_t brick = 0; brick < 2; ++brick) {
    const glm::ivec3 origin = hilbertPosition(number(offsets.at("BRIK") + 40 * brick, 8), 1) * 8;
    const uint64_t curveStart = hilbertIndex(origin, 4) / 512 * 512;
    for (size_t step = 0; step < 512; ++step) {
      const glm::ivec3 p = hilbertPosition(curveStart + step, 4);
      if (p.x >= 5 || p.y >= 7 || p.z >= 11) continue;
      const uint64_t i = linearIndex(p, {5, 7, 11});
      EXPECT_EQ(uint8_t(bytes[offsets.at("CODE") + brick * 512 + step]), e.codes[i]);
      EXPECT_EQ(uint8_t(bytes[offsets.at("ATTB") + (brick * 13 + 4) * 512 + step]), e.planes[4][i]);
      EXPECT_EQ(uint8_t(bytes[offsets.at("ATTF") + (brick * 13 + 12) * 512 + step]), e.planes[25][i]);
    }
  }
}

}  // namespace
}  // namespace freevoxel
