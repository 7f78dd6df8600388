#include <gtest/gtest.h>

#include <filesystem>
#include <glm/glm.hpp>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

/// The least that makes a DICOM image: explicit VR, little-endian.
struct DicomSlice {
  std::string series = "1.2.3";
  glm::dvec3 position{0.0};
  std::string orientation = "1\\0\\0\\0\\1\\0";
  std::string slope, intercept;
  int z = 0;

  static std::string element(uint16_t group, uint16_t number, const std::string& vr, std::string value) {
    if (value.size() % 2 == 1) value += vr == "UI" ? '\0' : ' ';
    Bytes bytes;
    bytes.add(group).add(number).text(vr);
    if (vr == "OW" || vr == "OB") {
      bytes.add(uint16_t(0)).add(uint32_t(value.size()));
    } else {
      bytes.add(uint16_t(value.size()));
    }
    return bytes.text(value).str();
  }
  static std::string number(uint16_t value) { return Bytes().add(value).str(); }

  std::string bytes() const {
    const std::string meta = element(2, 1, "OB", std::string("\0\1", 2)) +
                             element(2, 2, "UI", "1.2.840.10008.5.1.4.1.1.2") + element(2, 3, "UI", "1.2.3.4") +
                             element(2, 0x10, "UI", "1.2.840.10008.1.2.1") + element(2, 0x12, "UI", "1.2.3.5");
    std::string all = std::string(128, '\0') + "DICM" + element(2, 0, "UL", Bytes().add(uint32_t(meta.size())).str()) +
                      meta + element(8, 0x16, "UI", "1.2.840.10008.5.1.4.1.1.2") +
                      element(8, 0x18, "UI", "1.2.3.4." + std::to_string(z + 1)) + element(8, 0x60, "CS", "CT") +
                      element(0x18, 0x50, "DS", "99") + element(0x20, 0x0e, "UI", series) +
                      element(0x20, 0x32, "DS", fmt::format("{}\\{}\\{}", position.x, position.y, position.z)) +
                      element(0x20, 0x37, "DS", orientation) + element(0x28, 2, "US", number(1)) +
                      element(0x28, 4, "CS", "MONOCHROME2") + element(0x28, 0x10, "US", number(7)) +
                      element(0x28, 0x11, "US", number(5)) + element(0x28, 0x30, "DS", "0.5\\0.25") +
                      element(0x28, 0x100, "US", number(16)) + element(0x28, 0x101, "US", number(12)) +
                      element(0x28, 0x102, "US", number(11)) + element(0x28, 0x103, "US", number(0));
    if (!intercept.empty()) all += element(0x28, 0x1052, "DS", intercept) + element(0x28, 0x1053, "DS", slope);
    Bytes pixels;
    for (int i = 0; i < 35; ++i)
      pixels.add(uint16_t(z * 35 + i));
    return all + element(0x7fe0, 0x10, "OW", pixels.str());
  }
};

/// A folder of eleven slices, named against their order, each changed by `change`.
std::string series(const std::function<void(DicomSlice&)>& change = {}) {
  const std::string folder = temporaryFolder();
  for (int z = 0; z < 11; ++z) {
    DicomSlice slice;
    slice.z = z;
    slice.position = {10.0, 20.0, 30.0 + 1.5 * z};
    if (change) change(slice);
    writeBytes(fmt::format("{}/IM{:02}", folder, 50 - z), slice.bytes());
  }
  return folder;
}

class Dicom : public testing::Test {
 protected:
  TestReader reader;
};

}  // namespace

TEST_F(Dicom, slicesLieWhereTheirPositionsSay) {
  const Volume volume = readVolume(series());
  EXPECT_EQ(volume.header.dims, kDims);
  EXPECT_EQ(volume.header.type, ValueType::u16);
  for (uint64_t i = 0; i < volume.header.voxels(); ++i)
    ASSERT_EQ(volume.value(i), double(i));
  const Placement& placement = volume.header.placement;
  EXPECT_EQ(placement.spacing, glm::dvec3(0.25, 0.5, 1.5));
  EXPECT_EQ(placement.origin, glm::dvec3(-10.0, -20.0, 30.0));
  EXPECT_EQ(placement.direction, glm::dmat3(glm::dvec3(-1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, 1)));
}

TEST_F(Dicom, obliqueSeriesAndTiltedGantry) {
  const Volume oblique = readVolume(series([](DicomSlice& slice) {
    slice.orientation = "0\\1\\0\\0\\0\\-1";
    slice.position = {-5.0 - 2.0 * slice.z, 1.0, 2.0};
  }));
  EXPECT_EQ(oblique.header.placement.spacing, glm::dvec3(0.25, 0.5, 2.0));
  EXPECT_EQ(oblique.value(36), 36.0);
  EXPECT_EQ(glm::dvec3(oblique.header.placement.worldFromIndex() * glm::dvec4(4.0, 2.0, 1.0, 1.0)),
            glm::dvec3(7.0, -2.0, 1.0));
  const Volume tilted = readVolume(series([](DicomSlice& slice) {
    slice.position = {0.0, 0.5 * slice.z, 2.0 * slice.z};
  }));
  EXPECT_LT(glm::distance(glm::dvec3(tilted.header.placement.worldFromIndex() * glm::dvec4(0, 0, 4, 1)),
                          glm::dvec3(0.0, -2.0, 8.0)),
            1e-12);
}

TEST_F(Dicom, valuesAreRescaled) {
  const Volume hounsfield = readVolume(series([](DicomSlice& slice) {
    slice.slope = "1";
    slice.intercept = "-1024";
  }));
  EXPECT_EQ(hounsfield.header.type, ValueType::i16);
  EXPECT_EQ(hounsfield.value(100), 100.0 - 1024.0);
  const Volume halves = readVolume(series([](DicomSlice& slice) {
    slice.slope = "0.5";
    slice.intercept = "0";
  }));
  EXPECT_EQ(halves.header.type, ValueType::f32);
  EXPECT_EQ(halves.value(101), 50.5);
  // Every slice with a slope of its own, as PET has.
  const Volume pet = readVolume(series([](DicomSlice& slice) {
    slice.slope = std::to_string(slice.z + 1);
    slice.intercept = "0";
  }));
  EXPECT_EQ(pet.header.type, ValueType::f32);
  EXPECT_EQ(pet.value(2 * 35 + 1), 3.0 * (2 * 35 + 1));
}

TEST_F(Dicom, missingAndMixedSlices) {
  const std::string missing = series();
  std::filesystem::remove(missing + "/IM45");
  EXPECT_NE(inputError([&] { readVolume(missing); }).find("slices are missing: they lie 1.5 mm apart, but"),
            std::string::npos);
  const std::string mixed = series([](DicomSlice& slice) {
    if (slice.z == 4) slice.series = "1.2.4";
  });
  EXPECT_NE(inputError([&] { readVolume(mixed); }).find("mixed series"), std::string::npos);
  const std::string turned = series([](DicomSlice& slice) {
    if (slice.z == 4) slice.orientation = "0\\1\\0\\1\\0\\0";
  });
  EXPECT_NE(inputError([&] { readVolume(turned); }).find("lie in different directions"), std::string::npos);
  const std::string twice = series([](DicomSlice& slice) { slice.position.z = 30.0 + slice.z / 2; });
  EXPECT_NE(inputError([&] { readVolume(twice); }).find("lie in one place"), std::string::npos);
  const std::string flat = series([](DicomSlice& slice) { slice.orientation = "1\\0\\0\\1\\0\\0"; });
  EXPECT_NE(inputError([&] { readVolume(flat); }).find("perpendicular"), std::string::npos);
}

TEST_F(Dicom, truncationsFail) {
  const std::string folder = series();
  const std::string path = folder + "/IM47";
  const std::string whole = readBytes(path);
  // Shorter than its first 132 bytes a file without extension is no DICOM file, and a slice is missing.
  for (size_t length = 0; length < whole.size(); length += 29) {
    writeBytes(path, whole.substr(0, length));
    EXPECT_THROW(readVolume(folder), InputError) << length;
  }
}

}  // namespace freevoxel::test
