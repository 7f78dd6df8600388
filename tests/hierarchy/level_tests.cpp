// Levels from 1 on: what a voxel stands for, and files whose levels are damaged or made to mislead.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/packing.hpp>
#include <string>
#include <vector>

#include "base/error.h"
#include "hierarchy/attenuation_file.h"
#include "precompute/checksums.h"
#include "precompute/finest_matter.h"
#include "precompute/level_matter.h"
#include "precompute/precompute.h"
#include "precompute/stored_bricks.h"
#include "tests/precompute/test_volumes.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

LevelMatter reduced(const std::array<float, 8>& extinctions, glm::vec3 edges = glm::vec3(1.0f)) {
  std::array<LevelMatter, 8> matter;
  std::array<const LevelMatter*, 8> children{};
  for (size_t i = 0; i < 8; ++i) {
    matter[i] = {glm::vec3(0.25f, 0.5f, 1.0f) * extinctions[i], extinctions[i]};
    children[i] = &matter[i];
  }
  return reducedMatter(children, edges);
}

TEST(ReducedMatter, UniformMatterStaysAsItIs) {
  const LevelMatter result = reduced({0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f, 0.3f}, {1.0f, 1.5f, 2.0f});
  EXPECT_NEAR(result.extinction, 0.3f, 1e-6f);
  EXPECT_NEAR(result.glow.b, 0.3f, 1e-6f);
  EXPECT_NEAR(result.glow.r, 0.075f, 1e-6f);
}

TEST(ReducedMatter, ThinOpaqueSheetStaysOpaque) {
  constexpr float kOpaque = 8.3f;
  // Across z, y and x: two edges of the result let through what one of the sheet does.
  for (const std::array<float, 8>& sheet : {std::array<float, 8>{kOpaque, kOpaque, kOpaque, kOpaque, 0, 0, 0, 0},
                                            {kOpaque, kOpaque, 0, 0, kOpaque, kOpaque, 0, 0},
                                            {0, kOpaque, 0, kOpaque, 0, kOpaque, 0, kOpaque}})
    EXPECT_NEAR(reduced(sheet).extinction, 0.5f * kOpaque, 1e-5f);
}

TEST(ReducedMatter, OneOpaqueVoxelHidesAQuarter) {
  EXPECT_NEAR(std::exp(-2.0f * reduced({50.0f, 0, 0, 0, 0, 0, 0, 0}).extinction), 0.75f, 1e-6f);
}

TEST(ReducedMatter, ColoursCountByOpacity) {
  const LevelMatter red{{0.9f, 0.0f, 0.0f}, 0.9f}, blue{{0.0f, 0.0f, 0.1f}, 0.1f};
  const LevelMatter result = reducedMatter({&red, &blue, &red, &blue, &red, &blue, &red, &blue}, glm::vec3(2, 1, 3));
  const float ofRed = -std::expm1(-1.8f), ofBlue = -std::expm1(-0.2f);  // over two of the shortest edges
  EXPECT_NEAR(result.glow.r / result.extinction, ofRed / (ofRed + ofBlue), 1e-6f);
  EXPECT_NEAR(result.glow.b / result.extinction, ofBlue / (ofRed + ofBlue), 1e-6f);
  const LevelMatter nothing;
  EXPECT_EQ(reducedMatter({&nothing, &nothing, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr}, glm::vec3(1.0f))
                .extinction,
            0.0f);
}

/// A sheet that only interpolation shows: between 0 and 200 there is 100, and nothing else is visible.
TEST(FinestMatter, HoldsWhatLiesBetweenVoxels) {
  TransferFunction transfer;
  transfer.points = {{80.0, glm::dvec3(1.0), 0.0},
                     {100.0, glm::dvec3(1.0), 0.5},
                     {120.0, glm::dvec3(1.0), 0.0},
                     {255.0, glm::dvec3(1.0), 0.0}};
  const ValueCoding coding = valueCoding(ValueType::u8, 0.0, 255.0);
  FinestMatter::Codes codes;
  for (size_t i = 0; i < codes.size(); ++i)
    codes[i] = i % 4 < 2 ? 0 : 200;
  std::array<LevelMatter, 8> matter;
  const FinestMatter finest(transfer, coding);
  // A quarter of the way is 50 and 150: nothing.
  ASSERT_TRUE(finest.ofEight(codes, matter));
  EXPECT_EQ(matter[0].extinction, 0.0f);
  // 100 lies a quarter of the way from 66 to 202, and on one side only.
  for (size_t i = 0; i < codes.size(); ++i)
    codes[i] = i % 4 < 2 ? 66 : 202;
  ASSERT_TRUE(finest.ofEight(codes, matter));
  EXPECT_NEAR(matter[0].extinction, 0.5f * float(transfer.extinctionAt(100.0)), 1e-6f);
  EXPECT_EQ(matter[1].extinction, 0.0f);
  // Labels are not interpolated.
  transfer.isLabels = true;
  transfer.points = {{0.0, glm::dvec3(1.0), 0.0}, {66.0, glm::dvec3(1.0), 0.25}};
  const FinestMatter ofLabels(transfer, coding);
  ASSERT_TRUE(ofLabels.ofEight(codes, matter));
  EXPECT_NEAR(matter[0].extinction, -std::log(0.75f), 1e-6f);
  EXPECT_EQ(matter[1].extinction, 0.0f);
}

struct Tested {
  Layout layout;
  Hierarchy hierarchy;
};
class LevelFile : public testing::TestWithParam<Tested> {};
INSTANTIATE_TEST_SUITE_P(Kinds, LevelFile,
                         testing::Values(Tested{Layout::dense, Hierarchy::geometric},
                                         Tested{Layout::dense, Hierarchy::weighted},
                                         Tested{Layout::compact, Hierarchy::geometric}),
                         [](const auto& tested) {
                           return std::string(layoutName(tested.param.layout)) + "_" +
                                  std::string(hierarchyName(tested.param.hierarchy));
                         });

glm::ivec3 gridPosition(uint64_t i, glm::ivec3 dims) {
  return {int(i % uint64_t(dims.x)), int(i / uint64_t(dims.x) % uint64_t(dims.y)),
          int(i / (uint64_t(dims.x) * uint64_t(dims.y)))};
}

/// What the box of a voxel holds on average, by eight places inside of it.
LevelMatter meanOfBox(const std::vector<uint16_t>& codes, glm::ivec3 dims, glm::ivec3 p,
                      const TransferFunction& transfer, const ValueCoding& coding) {
  LevelMatter mean;
  for (int place = 0; place < 8; ++place) {
    const glm::ivec3 side = 2 * glm::ivec3(place & 1, place >> 1 & 1, place >> 2) - 1;
    double code = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 away(corner & 1, corner >> 1 & 1, corner >> 2);
      const glm::ivec3 q = glm::clamp(p + side * away, glm::ivec3(0), dims - 1);
      code += codes[linearIndex(q, dims)] * (away.x ? 0.25 : 0.75) * (away.y ? 0.25 : 0.75) * (away.z ? 0.25 : 0.75);
    }
    const Classified at = transfer.at(coding.decode(code));
    mean.glow += 0.125f * at.linear * at.extinction;
    mean.extinction += 0.125f * at.extinction;
  }
  return mean;
}

PrecomputeOptions optionsOf(const Tested& tested, int edge) {
  PrecomputeOptions options;
  options.classification = Classification::voxel;
  options.layout = tested.layout;
  options.brickEdge = edge;
  options.hierarchy = tested.hierarchy;
  options.levels = 0;
  return options;
}

/// Attenuation of every voxel of every level against means of what a sweep gives, and matter against reducedMatter.
TEST_P(LevelFile, StandsForTheFinestLevel) {
  const glm::ivec3 dims(21, 17, 37);
  // Depths up to 3 log2, so that bytes of the finest level tell what the sweep knew.
  TransferFunction transfer = test::veilAndRamp();
  for (TransferPoint& point : transfer.points)
    point.opacity *= 0.08;
  const Volume volume = test::randomBytes(dims, 51);
  const std::string path = test::temporaryFolder() + "/levels.fvx";
  precompute(volume, transfer, path, optionsOf(GetParam(), 8), test::silentProgress());
  const AttenuationFile file(path);
  file.verify();
  ASSERT_EQ(file.levels(), 4);
  EXPECT_EQ(file.hierarchy(), GetParam().hierarchy);
  const auto codes = encodeValues(volume, file.coding());
  const test::Planes planes =
      test::sweepAll(codes, dims, *makeSegmentDepth(Classification::voxel, transfer, file.coding()));
  const glm::vec3 edges(file.placement().spacing / file.placement().unitLength());

  const bool geometric = GetParam().hierarchy == Hierarchy::geometric;
  glm::ivec3 finer = dims;
  std::vector<LevelMatter> matter;
  for (uint64_t i = 0; i < codes.size(); ++i)
    matter.push_back(meanOfBox(codes, dims, gridPosition(i, dims), transfer, file.coding()));
  std::vector<std::vector<double>> means;  // of each direction: depth (geometric) or attenuation (weighted)
  for (const auto& plane : planes) {
    means.emplace_back();
    for (const uint8_t code : plane)
      means.back().push_back(geometric ? -std::log2(std::max<int>(code, 1) / 255.0) : code / 255.0);
  }
  for (int level = 1; level < file.levels(); ++level) {
    const glm::ivec3 coarse = file.levelDims(level);
    EXPECT_EQ(coarse, (finer + 1) / 2);
    std::vector<LevelMatter> coarseMatter(voxelCount(coarse));
    std::vector<std::vector<double>> coarseMeans(means.size(), std::vector<double>(voxelCount(coarse)));
    for (uint64_t i = 0; i < voxelCount(coarse); ++i) {
      const glm::ivec3 p(int(i) % coarse.x, int(i) / coarse.x % coarse.y, int(i) / (coarse.x * coarse.y));
      std::array<const LevelMatter*, 8> children{};
      double weights = 0.0, count = 0.0;
      std::vector<double> weighed(means.size()), plain(means.size());
      for (size_t child = 0; child < 8; ++child) {
        const glm::ivec3 q = 2 * p + glm::ivec3(child & 1, child >> 1 & 1, child >> 2);
        if (glm::any(glm::greaterThanEqual(q, finer))) continue;
        const uint64_t at = linearIndex(q, finer);
        children[child] = &matter[at];
        // The sweep knows a voxel of the finest level by its code alone.
        const double extinction =
            level == 1 ? transfer.extinctionAt(file.coding().decode(codes[at])) : double(matter[at].extinction);
        const double weight = -std::expm1(-extinction * (1 << (level - 1)));
        weights += weight;
        count += 1.0;
        for (size_t k = 0; k < means.size(); ++k) {
          weighed[k] += weight * means[k][at];
          plain[k] += geometric ? means[k][at] : -std::log2(std::max(means[k][at], 1.0 / 255.0));
        }
      }
      coarseMatter[i] = reducedMatter(children, edges * float(1 << (level - 1)));
      const bool byWeight = !geometric && weights > 0.0;
      for (size_t k = 0; k < means.size(); ++k)
        coarseMeans[k][i] = byWeight    ? weighed[k] / weights
                            : geometric ? plain[k] / count
                                        : std::exp2(-plain[k] / count);
    }
    for (size_t b = 0; b < file.levelBrickCount(level); ++b) {
      const BrickView brick = file.levelBrick(level, b);
      EXPECT_EQ(file.findLevelBrick(level, brick.origin / brick.edge), b);
      for (size_t step = 0; step < brick.curve.size(); ++step) {
        const glm::ivec3 p = brick.origin + glm::ivec3(brick.curve[step].x, brick.curve[step].y, brick.curve[step].z);
        if (glm::any(glm::greaterThanEqual(p, coarse))) {
          ASSERT_EQ(brick.matter[3][step], 0);
          ASSERT_EQ(brick.attenuations[0][step], 255);
          continue;
        }
        const uint64_t i = linearIndex(p, coarse);
        const float extinction = glm::unpackHalf1x16(brick.matter[3][step]) * std::numbers::ln2_v<float>;
        ASSERT_NEAR(extinction, coarseMatter[i].extinction, 0.001f * coarseMatter[i].extinction + 1e-6f);
        if (extinction > 0.0f) {
          ASSERT_NEAR(float(brick.matter[1][step]) / 65535.0f, coarseMatter[i].glow.g / coarseMatter[i].extinction,
                      1e-4f);
        }
        for (size_t k = 0; k < means.size(); ++k) {
          const double expected = geometric ? std::exp2(-coarseMeans[k][i]) : coarseMeans[k][i];
          // The bytes that this starts from are half a code off, on the way up up to another half, and so is the
          // result.
          ASSERT_NEAR(brick.attenuations[k][step], 255.0 * expected, 1.5) << "level " << level << ", direction " << k;
        }
      }
    }
    finer = coarse;
    matter = coarseMatter;
    means = coarseMeans;
  }
}

std::string makeLevelFile(Layout layout) {
  const std::string path = test::temporaryFolder() + "/made.fvx";
  PrecomputeOptions options = optionsOf({layout, Hierarchy::geometric}, 8);
  precompute(test::randomBytes({9, 7, 6}, 52), test::veilAndRamp(), path, options, test::silentProgress());
  return test::readBytes(path);
}

std::string levelComplaint(const std::string& path) {
  try {
    AttenuationFile(path).verify();
    return {};
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
    return error.what();
  }
}

TEST(DamagedLevels, EveryTruncationAndEveryChangedByteAreFound) {
  const std::string path = test::temporaryFolder() + "/cut.fvx";
  const std::string whole = makeLevelFile(Layout::compact);
  test::writeBytes(path, whole);
  ASSERT_EQ(levelComplaint(path), "");
  ASSERT_EQ(AttenuationFile(path).levels(), 2);
  {
    std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
    for (size_t at = 0; at < whole.size(); ++at) {
      file.seekp(std::streamoff(at)).put(char(whole[at] ^ (1 << at % 8))).flush();
      ASSERT_NE(levelComplaint(path), "") << at;
      file.seekp(std::streamoff(at)).put(whole[at]).flush();
    }
  }
  for (size_t bytes = whole.size(); bytes-- > 0;) {
    std::filesystem::resize_file(path, bytes);
    ASSERT_NE(levelComplaint(path), "") << bytes;
  }
}

/// Changes a field of LEVL's first entry, or of the section table, and makes all checksums right again.
std::string complaintOfForged(const std::function<void(LevelEntry&)>& changeEntry,
                              const std::function<void(SectionEntry&)>& changeSection = {},
                              const std::string& section = "LEVL") {
  std::string bytes = makeLevelFile(Layout::dense);
  FileHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  std::vector<SectionEntry> sections(header.sectionCount);
  std::memcpy(sections.data(), bytes.data() + sizeof(header), sections.size() * sizeof(SectionEntry));
  for (SectionEntry& entry : sections) {
    const std::string type(entry.type.data(), entry.type.size());
    if (type == "LEVL") {
      LevelEntry first;
      std::memcpy(&first, bytes.data() + entry.offset, sizeof(first));
      changeEntry(first);
      std::memcpy(bytes.data() + entry.offset, &first, sizeof(first));
      entry.hash = contentHash(std::as_bytes(std::span(bytes)).subspan(entry.offset, entry.bytes));
    }
    if (type == section && changeSection) changeSection(entry);
  }
  header.hash = headerHash(header, sections);
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::memcpy(bytes.data() + sizeof(header), sections.data(), sections.size() * sizeof(SectionEntry));
  const std::string path = test::temporaryFolder() + "/forged.fvx";
  test::writeBytes(path, bytes);
  return levelComplaint(path);
}

TEST(DamagedLevels, LevelsThatLieAreRefused) {
  const auto expectRefused = [](const char* what, const std::string& said) {
    EXPECT_NE(said.find(what), std::string::npos) << what << ": " << said;
  };
  EXPECT_EQ(complaintOfForged([](LevelEntry&) {}), "");
  expectRefused("level of entry 0", complaintOfForged([](LevelEntry& e) { e.level = 2; }));
  expectRefused("Hilbert index of entry 0", complaintOfForged([](LevelEntry& e) { e.hilbertIndex = 1; }));
  expectRefused("reserved", complaintOfForged([](LevelEntry& e) { e.zero0 = 1; }));
  expectRefused("reserved", complaintOfForged([](LevelEntry& e) { e.zero1 = 1; }));
  expectRefused("offset of brick 0 in LMAT", complaintOfForged([](LevelEntry& e) { e.offset[0] = ~uint64_t(0); }));
  expectRefused("bytes of brick 0 in LATB", complaintOfForged([](LevelEntry& e) { e.bytes[1] = ~uint32_t(0); }));
  expectRefused("bytes of the frames of LATF", complaintOfForged([](LevelEntry& e) { e.bytes[2] = 0; }));
  expectRefused("checksum of section LMAT",
                complaintOfForged([](LevelEntry& e) { e.hash[0] ^= 1; }, [](SectionEntry&) {}));
  expectRefused("directory of levels",
                complaintOfForged([](LevelEntry&) {}, [](SectionEntry& s) { s.items = ~uint64_t(0) / 80 + 2; }));
  expectRefused("items of LMAT", complaintOfForged([](LevelEntry&) {}, [](SectionEntry& s) { s.items = 7; }, "LMAT"));
}

TEST(Levels, AreAsManyAsAskedForAndNoMoreThanThereCanBe) {
  const std::string path = test::temporaryFolder() + "/levels.fvx";
  for (const auto& [asked, levels] : {std::pair(0, 3), std::pair(1, 1), std::pair(2, 2), std::pair(9, 3)}) {
    PrecomputeOptions options;
    options.brickEdge = 8;
    options.levels = asked;
    EXPECT_EQ(precompute(test::randomBytes({25, 7, 11}, 53), test::veilAndRamp(), path, options, test::silentProgress())
                  .levels,
              levels);
    EXPECT_EQ(AttenuationFile(path).levels(), levels);
  }
}

}  // namespace
}  // namespace freevoxel
