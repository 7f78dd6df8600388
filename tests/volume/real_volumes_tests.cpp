// One test per data set: what its file says of it, and range and sum of its values. The expected numbers were read from
// the files by programs that share nothing with ours.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <set>

#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

VolumeOptions raw(glm::ivec3 dims, ValueType type, ByteOrder order = ByteOrder::little) {
  VolumeOptions options;
  options.dims = dims;
  options.type = type;
  options.byteOrder = order;
  return options;
}

class RealVolumes : public testing::Test {
 protected:
  void SetUp() override {
    if (!dataFolder()) GTEST_SKIP() << kNoData;
  }

  static Volume read(const std::string& name, const VolumeOptions& options = {}) {
    return readVolume(*dataFolder() + "/volumes/" + name, options);
  }

  static void expectHeader(const Volume& volume, glm::ivec3 dims, ValueType type, glm::dvec3 spacing = {1, 1, 1}) {
    EXPECT_EQ(volume.header.dims, dims);
    EXPECT_EQ(volume.header.type, type);
    EXPECT_LT(glm::distance(volume.header.placement.spacing, spacing), 1e-7);
    EXPECT_EQ(volume.data.size(), volume.header.bytes());
  }

  static void expectStatistics(const Volume& volume, double low, double high, double sum) {
    const ValueStatistics statistics = valueStatistics(volume);
    EXPECT_EQ(statistics.low, low);
    EXPECT_EQ(statistics.high, high);
    EXPECT_EQ(statistics.nonFinite, 0u);
    if (isFloatingPoint(volume.header.type)) {
      EXPECT_NEAR(statistics.sum, sum, 1e-9 * std::abs(sum));
    } else {
      EXPECT_EQ(statistics.sum, sum);
    }
  }
};

}  // namespace

TEST_F(RealVolumes, embryo) {
  const Volume volume = read("embryo_256x256x256_uint8.raw.gz", raw({256, 256, 256}, ValueType::u8));
  expectHeader(volume, {256, 256, 256}, ValueType::u8);
  expectStatistics(volume, 0.0, 197.0, 63724611.0);
}

TEST_F(RealVolumes, aneurism) {
  const Volume volume = read("aneurism_256x256x256_uint8.raw.gz", raw({256, 256, 256}, ValueType::u8));
  expectHeader(volume, {256, 256, 256}, ValueType::u8);
  expectStatistics(volume, 0.0, 255.0, 17938365.0);
}

TEST_F(RealVolumes, ctHead) {
  VolumeOptions options = raw({256, 256, 113}, ValueType::u16, ByteOrder::big);
  options.spacing = glm::dvec3(1.0, 1.0, 2.0);
  const Volume volume = read("cthead_256x256x113_uint16_be.raw.gz", options);
  expectHeader(volume, {256, 256, 113}, ValueType::u16, {1.0, 1.0, 2.0});
  expectStatistics(volume, 0.0, 3272.0, 2810724494.0);
}

TEST_F(RealVolumes, hydrogen) {
  const Volume volume = read("hydrogen_atom_128x128x128_uint8.raw.gz", raw({128, 128, 128}, ValueType::u8));
  expectHeader(volume, {128, 128, 128}, ValueType::u8);
  expectStatistics(volume, 0.0, 250.0, 5990975.0);
}

TEST_F(RealVolumes, vorticity) {
  const Volume volume = read("vorticity_128x128x41_float32_le.raw.gz", raw({128, 128, 41}, ValueType::f32));
  expectHeader(volume, {128, 128, 41}, ValueType::f32);
  expectStatistics(volume, -0.0002043386484729126, 0.0002281117340316996, -0.5701328042378263);
}

TEST_F(RealVolumes, stent) {
  const Volume volume = read("stent.nrrd");
  expectHeader(volume, {128, 128, 256}, ValueType::f32);
  expectStatistics(volume, 0.0, 1.0, 74235.45305449888);
  std::set<double> distinct;
  for (uint64_t i = 0; i < volume.header.voxels(); ++i)
    distinct.insert(volume.value(i));
  EXPECT_EQ(distinct.size(), 33u);
}

TEST_F(RealVolumes, headsq) {
  const Volume volume = read("headsq/quarter.nhdr");
  expectHeader(volume, {64, 64, 93}, ValueType::i16, {3.2, 3.2, 1.5});
  EXPECT_EQ(volume.header.placement.direction, glm::dmat3(1.0));
  expectStatistics(volume, 0.0, 3926.0, 193392317.0);
}

TEST_F(RealVolumes, nucleon) {
  const Volume volume = read("nucleon/nucleon.nrrd");
  expectHeader(volume, {41, 41, 41}, ValueType::u8);
  expectStatistics(volume, 0.0, 249.0, 2715326.0);
}

TEST_F(RealVolumes, nucleonByItsDatHeader) {
  const Volume volume = read("nucleon/nucleon.dat");
  expectHeader(volume, {41, 41, 41}, ValueType::u8);
  EXPECT_EQ(volume.data, read("nucleon/nucleon.nrrd").data);
}

TEST_F(RealVolumes, carp) {
  const Volume volume = read("carp.nii.gz");
  expectHeader(volume, {256, 512, 256}, ValueType::u8);
  EXPECT_EQ(volume.header.placement.origin, glm::dvec3(-127.5, -255.5, -127.5));
  expectStatistics(volume, 0.0, 254.0, 423854130.0);
}

TEST_F(RealVolumes, brain) {
  const Volume volume = read("brain_ch256.nii.gz");
  expectHeader(volume, {208, 256, 219}, ValueType::u8, glm::dvec3(0.72f));
  EXPECT_EQ(volume.header.placement.origin, glm::dvec3(-75.0, -107.0, -69.5));
  expectStatistics(volume, 0.0, 127.0, 402889898.0);
}

TEST_F(RealVolumes, avg152LeftAndRightByItsLetters) {
  const Volume volume = read("avg152T1_RL_bigendian.nii.gz");
  expectHeader(volume, {91, 109, 91}, ValueType::u8, {2.0, 2.0, 2.0});
  EXPECT_EQ(volume.header.placement.origin, glm::dvec3(-90.0, -126.0, -72.0));
  expectStatistics(volume, 0.0, 255.0, 74825382.0);
  // The bars are letters, an L and an R. In the row through their tops the L shows its stem only, the R its bowl.
  int left = 0, right = 0;
  for (int x = 0; x < volume.header.dims.x; ++x) {
    const glm::ivec3 p(x, 66, 14);
    if (volume.value(linearIndex(p, volume.header.dims)) != 255.0) continue;
    ++(glm::dvec3(volume.header.placement.worldFromIndex() * glm::dvec4(p, 1.0)).x < 0.0 ? left : right);
  }
  EXPECT_EQ(left, 6);
  EXPECT_GT(right, 20);
}

TEST_F(RealVolumes, frogtissue) {
  const Volume volume = read("frogtissue/frogtissue.mhd");
  expectHeader(volume, {500, 470, 136}, ValueType::u8, {1.0, 1.0, 1.5});
  expectStatistics(volume, 0.0, 29.0, 12279472.0);
}

TEST_F(RealVolumes, neghip) {
  const Volume volume = read("neghip.mha");
  expectHeader(volume, {70, 70, 70}, ValueType::u8);
  expectStatistics(volume, 0.0, 255.0, 4824177.0);
  // A border of three voxels of 0.
  for (uint64_t i = 0; i < volume.header.voxels(); ++i) {
    const glm::ivec3 p(int(i % 70), int(i / 70 % 70), int(i / 4900));
    const bool border = glm::any(glm::lessThan(p, glm::ivec3(3))) || glm::any(glm::greaterThan(p, glm::ivec3(66)));
    ASSERT_TRUE(!border || volume.value(i) == 0.0);
  }
}

TEST_F(RealVolumes, carotid) {
  const Volume volume = read("carotid.vtk");
  expectHeader(volume, {76, 49, 45}, ValueType::f32);
  EXPECT_EQ(volume.header.placement.origin, glm::dvec3(100.0, 80.0, 1.0));
  expectStatistics(volume, 0.0, 580.0, 16598647.0);
  VolumeOptions flow;
  flow.component = "vectors.2";
  expectStatistics(read("carotid.vtk", flow), -17.465517044067383, 9.759259223937988, 9407.890808553379);
}

TEST_F(RealVolumes, dicomSeries) {
  const TestReader reader;
  const Volume volume = read("dicom_t1w");
  expectHeader(volume, {274, 384, 96}, ValueType::i16, {0.699987828731537, 0.666666686534882, 2.6666667461395233});
  expectStatistics(volume, 0.0, 231.0, 111486157.0);
  // Oblique: the first slice's position and orientation as its file has them, LPS turned into RAS.
  const Placement& placement = volume.header.placement;
  EXPECT_LT(glm::distance(placement.origin, glm::dvec3(91.449586, 160.060359, -142.505487)), 1e-5);
  EXPECT_LT(glm::distance(placement.direction[0], glm::dvec3(-0.99903218, 0.02178838, 0.03820965)), 1e-6);
  EXPECT_LT(glm::distance(placement.direction[1], glm::dvec3(-0.02651948, -0.99141387, -0.12804396)), 1e-6);
  const glm::dvec3 last(placement.worldFromIndex() * glm::dvec4(0.0, 0.0, 95.0, 1.0));
  EXPECT_LT(glm::distance(last, glm::dvec3(100.339484, 127.397247, 108.556004)), 1e-3);
}

TEST_F(RealVolumes, smoke) {
  const TestReader reader;
  const Volume volume = readVolume(*dataFolder() + "/vdb/smoke.vdb");
  expectHeader(volume, {111, 222, 112}, ValueType::f32, glm::dvec3(10.0 / 21.0));
  // The first active voxel is (1,2,1) of the grid.
  EXPECT_LT(glm::distance(volume.header.placement.origin, glm::dvec3(-33.5714286, -12.1428571, -25.9523810)), 1e-6);
  expectStatistics(volume, 0.0, 5.71484375, 171499.69552135468);
  uint64_t active = 0;
  for (uint64_t i = 0; i < volume.header.voxels(); ++i)
    active += volume.value(i) > 0.0;
  EXPECT_EQ(active, 1049275u);
}

TEST_F(RealVolumes, sphere) {
  const TestReader reader;
  const Volume volume = readVolume(*dataFolder() + "/vdb/sphere.vdb");
  expectHeader(volume, {125, 125, 125}, ValueType::f32, glm::dvec3(0.05f));
  expectStatistics(volume, -0.1500244140625, 0.1500244140625, 20860.581398010254);
  uint64_t active = 0;
  for (uint64_t i = 0; i < volume.header.voxels(); ++i)
    active += std::abs(volume.value(i)) < 0.14999;
  EXPECT_EQ(active, 270638u);
  // The middle is inside, a corner outside.
  EXPECT_NEAR(volume.value(linearIndex({62, 62, 62}, volume.header.dims)), -0.15, 1e-4);
  EXPECT_NEAR(volume.value(0), 0.15, 1e-4);
}

}  // namespace freevoxel::test
