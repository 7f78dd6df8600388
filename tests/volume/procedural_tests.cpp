#include "volume/procedural.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "base/error.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

double valueAt(const Volume& volume, int x, int y, int z) {
  return volume.value(linearIndex({x, y, z}, volume.header.dims));
}

}  // namespace

TEST(Procedural, everyKindIsListedOnceAndHasItsType) {
  std::vector<std::string> names;
  for (const ProceduralKind& kind : proceduralKinds()) {
    names.push_back(kind.name);
    EXPECT_FALSE(kind.description.empty());
    const Volume volume = generateVolume(kind.name, kDims);
    EXPECT_EQ(volume.header.type, kind.type) << kind.name;
    EXPECT_EQ(volume.header.dims, kDims);
    EXPECT_EQ(volume.data.size(), volume.header.bytes());
    EXPECT_EQ(valueStatistics(volume).nonFinite, 0u);
  }
  EXPECT_EQ(names, (std::vector<std::string>{"cube", "sphere", "ramp", "marschner-lobb", "shepp-logan", "cloud",
                                             "checkered-cloud", "menger", "kronecker", "shells"}));
}

TEST(Procedural, slicesAreTheWholeForAnyNumberOfThreads) {
  const int threads = omp_get_max_threads();
  const glm::ivec3 dims(19, 23, 29);
  for (const ProceduralKind& kind : proceduralKinds()) {
    omp_set_num_threads(1);
    const Volume one = generateVolume(kind.name, dims, 5);
    omp_set_num_threads(3);
    EXPECT_EQ(generateVolume(kind.name, dims, 5).data, one.data) << kind.name;
    std::vector<std::byte> slices(one.data.size() / size_t(dims.z) * 7);
    generateSlices(kind.name, dims, 5, 11, 7, slices);
    EXPECT_TRUE(std::equal(slices.begin(), slices.end(), one.data.begin() + std::ptrdiff_t(slices.size() / 7 * 11)))
        << kind.name;
  }
  omp_set_num_threads(threads);
}

TEST(Procedural, onlyRandomKindsLookAtTheSeed) {
  for (const ProceduralKind& kind : proceduralKinds()) {
    const bool random = kind.name == "cloud" || kind.name == "checkered-cloud" || kind.name == "kronecker";
    EXPECT_EQ(generateVolume(kind.name, {17, 16, 15}, 1).data != generateVolume(kind.name, {17, 16, 15}, 2).data,
              random)
        << kind.name;
  }
}

TEST(Procedural, anyDimsWork) {
  for (const ProceduralKind& kind : proceduralKinds()) {
    for (const glm::ivec3 dims : {glm::ivec3(1), glm::ivec3(1, 2, 3), glm::ivec3(300, 1, 2)}) {
      EXPECT_EQ(valueStatistics(generateVolume(kind.name, dims)).nonFinite, 0u) << kind.name;
    }
  }
}

TEST(Procedural, whatIsWrongIsNamed) {
  EXPECT_EQ(inputError([] { generateVolume("blob", kDims); }).substr(0, 44),
            "generate: unknown kind 'blob', expected one ");
  EXPECT_THROW(generateVolume("cube", {0, 1, 1}), InputError);
  EXPECT_THROW(generateVolume("cube", {1, kMaxDim + 1, 1}), InputError);
  EXPECT_THROW(generateVolume("ramp", {kMaxDim, kMaxDim, kMaxDim}), InputError);
  EXPECT_THROW(generateVolume("cube", {kMaxDim, kMaxDim, kMaxDim}), MachineError);
}

TEST(Procedural, cubeIsUniform) {
  const ValueStatistics statistics = valueStatistics(generateVolume("cube", kDims));
  EXPECT_EQ(statistics.low, 128.0);
  EXPECT_EQ(statistics.high, 128.0);
}

TEST(Procedural, sphereHasItsVolume) {
  const glm::ivec3 dims(50, 60, 70);
  const Volume sphere = generateVolume("sphere", dims);
  const double expected = 255.0 * 4.0 / 3.0 * std::numbers::pi * 0.8 * 0.8 * 0.8 / 8.0;
  EXPECT_NEAR(valueStatistics(sphere).sum / double(voxelCount(dims)), expected, 0.005 * expected);
  EXPECT_EQ(valueAt(sphere, 25, 30, 35), 255.0);
  EXPECT_EQ(valueAt(sphere, 0, 0, 0), 0.0);
  EXPECT_EQ(valueAt(sphere, 7, 30, 35), 255.0);  // 0.7 from the middle
  EXPECT_EQ(valueAt(sphere, 2, 30, 35), 0.0);    // 0.9
}

TEST(Procedural, rampTellsTheAxesApart) {
  const Volume ramp = generateVolume("ramp", kDims);
  EXPECT_EQ(valueAt(ramp, 0, 0, 0), 0.0);
  EXPECT_FLOAT_EQ(float(valueAt(ramp, 4, 0, 0)), 4.0f / 7.0f);
  EXPECT_FLOAT_EQ(float(valueAt(ramp, 0, 6, 0)), 2.0f / 7.0f);
  EXPECT_FLOAT_EQ(float(valueAt(ramp, 0, 0, 10)), 1.0f / 7.0f);
  EXPECT_EQ(valueAt(ramp, 4, 6, 10), 1.0);
  for (uint64_t i = 0; i < ramp.header.voxels(); ++i) {  // symmetric about the middle
    EXPECT_NEAR(ramp.value(i) + ramp.value(ramp.header.voxels() - 1 - i), 1.0, 1e-6);
  }
}

TEST(Procedural, marschnerLobbFollowsItsFormula) {
  const Volume volume = generateVolume("marschner-lobb", {41, 41, 41});
  // On the axis cos(2 pi 6 cos 0) = 1: (1 - sin(pi z / 2) + 0.5) / 2.5.
  EXPECT_FLOAT_EQ(float(valueAt(volume, 20, 20, 20)), 0.6f);
  EXPECT_FLOAT_EQ(float(valueAt(volume, 20, 20, 0)), 1.0f);
  EXPECT_FLOAT_EQ(float(valueAt(volume, 20, 20, 40)), 0.2f);
  const double r = std::sqrt(0.3 * 0.3 + 0.45 * 0.45);
  const double rings = std::cos(12.0 * std::numbers::pi * std::cos(0.5 * std::numbers::pi * r));
  const double expected = (1.0 - std::sin(0.5 * std::numbers::pi * -0.25) + 0.25 * (1.0 + rings)) / 2.5;
  EXPECT_NEAR(valueAt(volume, 26, 11, 15), expected, 1e-6);
}

TEST(Procedural, sheppLoganHasItsLevels) {
  const Volume phantom = generateVolume("shepp-logan", {101, 101, 101});
  EXPECT_EQ(valueAt(phantom, 0, 0, 0), 0.0);
  EXPECT_EQ(valueAt(phantom, 50, 95, 50), 1000.0);  // skull
  EXPECT_EQ(valueAt(phantom, 50, 50, 50), 200.0);   // brain
  EXPECT_EQ(valueAt(phantom, 61, 50, 50), 0.0);     // right ventricle
  EXPECT_EQ(valueAt(phantom, 39, 50, 50), 0.0);     // left ventricle
  EXPECT_EQ(valueAt(phantom, 50, 67, 43), 300.0);   // large tumour
  EXPECT_EQ(valueAt(phantom, 50, 55, 63), 300.0);   // small one
}

TEST(Procedural, cloudsAreSparseSoftAndAlike) {
  const glm::ivec3 dims(64, 64, 64);
  const Volume cloud = generateVolume("cloud", dims);
  const Volume checkered = generateVolume("checkered-cloud", dims);
  uint64_t filled = 0;
  for (uint64_t i = 0; i < cloud.header.voxels(); ++i) {
    filled += cloud.value(i) > 0.0 ? 1 : 0;
    EXPECT_NEAR(std::abs(checkered.value(i) - 128.0) * 255.0 / 127.0, cloud.value(i), 1.6);
  }
  const double fraction = double(filled) / double(cloud.header.voxels());
  EXPECT_GT(fraction, 0.05);
  EXPECT_LT(fraction, 0.3);
  double largestStep = 0.0;
  for (uint64_t i = 1; i < cloud.header.voxels(); ++i) {
    if (i % 64 != 0) largestStep = std::max(largestStep, std::abs(cloud.value(i) - cloud.value(i - 1)));
  }
  EXPECT_LT(largestStep, 80.0);
  EXPECT_GT(valueStatistics(checkered).high, 180.0);
  EXPECT_LT(valueStatistics(checkered).low, 80.0);
}

TEST(Procedural, cloudsDoNotTouchTheBox) {
  const glm::ivec3 dims(40, 40, 40);
  const Volume cloud = generateVolume("cloud", dims);
  for (int a = 0; a < 40; ++a) {
    for (int b = 0; b < 40; ++b) {
      for (const int side : {0, 39}) {
        EXPECT_EQ(valueAt(cloud, side, a, b), 0.0);
        EXPECT_EQ(valueAt(cloud, a, side, b), 0.0);
        EXPECT_EQ(valueAt(cloud, a, b, side), 0.0);
      }
    }
  }
}

TEST(Procedural, mengerCountsItsCubes) {
  // 20 of 27 cubes stay at every level; as many voxels per cube in each box.
  EXPECT_EQ(valueStatistics(generateVolume("menger", {3, 3, 3})).sum, 255.0 * 20);
  EXPECT_EQ(valueStatistics(generateVolume("menger", {27, 27, 27})).sum, 255.0 * 8000);
  EXPECT_EQ(valueStatistics(generateVolume("menger", {9, 18, 27})).sum, 255.0 * 400 * 6);
}

TEST(Procedural, kroneckerIsStandardised) {
  const Volume field = generateVolume("kronecker", {40, 50, 60});
  const auto count = double(field.header.voxels());
  double sum = 0.0, squares = 0.0, outside = 0.0;
  for (uint64_t i = 0; i < field.header.voxels(); ++i) {
    const double value = field.value(i);
    sum += value;
    squares += value * value;
    outside += std::abs(value) > 0.95 ? 1.0 : 0.0;
  }
  EXPECT_NEAR(sum / count, 0.0, 1e-6);
  EXPECT_NEAR(squares / count, 1.0, 1e-6);
  EXPECT_NEAR(outside / count, 0.34, 0.02);
}

TEST(Procedural, shellsLieAtTheirRadii) {
  const Volume shells = generateVolume("shells", {200, 201, 202});
  for (int shell = 0; shell < 6; ++shell) {
    const int x = int(100.0 + 100.0 * (0.15 + 0.15 * shell));
    EXPECT_EQ(valueAt(shells, x, 100, 101), 240.0 - 40.0 * shell);
    EXPECT_EQ(valueAt(shells, x + 7, 100, 101), 0.0);
  }
}

}  // namespace freevoxel::test
