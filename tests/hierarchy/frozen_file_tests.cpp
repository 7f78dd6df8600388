// Files written by earlier versions stay readable, byte for byte. One file per version of the format and layout, never
// rewritten.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>

#include "hierarchy/attenuation_file.h"
#include "precompute/sweep.h"
#include "shaders/shared/directions.h"
#include "tests/precompute/test_volumes.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

/// What the files of version 1 in tests/hierarchy/data were made of.
Volume frozenVolume() {
  return test::makeVolume<uint8_t>(ValueType::u8, {5, 7, 11}, [](int x, int y, int z) {
    return uint8_t((x * 37 + y * 11 + z * 23 + x * y * z) % 256);
  });
}

/// Attenuation may be off by `tolerance`.
void expectVersion1(const std::string& name, Layout layout, int tolerance) {
  const AttenuationFile file(test::sourceFolder() + "/tests/hierarchy/data/" + name);
  file.verify();
  const Volume volume = frozenVolume();
  const glm::ivec3 dims = volume.header.dims;
  const TransferFunction transfer = test::veilAndRamp();
  EXPECT_EQ(file.dims(), dims);
  EXPECT_EQ(file.placement().spacing, volume.header.placement.spacing);
  EXPECT_EQ(file.placement().origin, volume.header.placement.origin);
  EXPECT_EQ(file.classification(), Classification::voxel);
  EXPECT_EQ(file.layout(), layout);
  EXPECT_EQ(file.brickEdge(), 8);
  EXPECT_TRUE(file.command().starts_with("freevoxel precompute frozen.nrrd --classification voxel --brick 8"));
  EXPECT_EQ(transferFunctionJson(file.transfer()), transferFunctionJson(transfer));
  ASSERT_EQ(file.brickCount(), 2u);

  const auto codes = encodeValues(volume, file.coding());
  const auto segments = makeSegmentDepth(Classification::voxel, transfer, file.coding());
  const test::Planes planes = test::sweepAll(codes, dims, *segments);
  for (size_t b = 0; b < file.brickCount(); ++b) {
    const BrickView brick = file.brick(b);
    for (size_t step = 0; step < brick.curve.size(); ++step) {
      const glm::ivec3 p = brick.origin + glm::ivec3(brick.curve[step].x, brick.curve[step].y, brick.curve[step].z);
      if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) continue;
      const uint64_t i = linearIndex(p, dims);
      ASSERT_EQ(brick.code(step), codes[i]);
      for (size_t k = 0; k < planes.size(); ++k)
        ASSERT_LE(std::abs(int(brick.attenuations[k][step]) - int(planes[k][i])), tolerance);
    }
  }
}

TEST(FrozenFile, version1) {
  // Written when the byte nearest to A was chosen to within 0.0045 of the middle between two instead of 0.038.
  expectVersion1("version1.fvx", Layout::dense, 1);
}

TEST(FrozenFile, version1Compact) {
  expectVersion1("version1_compact.fvx", Layout::compact, 1);
}

}  // namespace
}  // namespace freevoxel
