#include <gtest/gtest.h>

#include <filesystem>
#include <glm/glm.hpp>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/dicom_slice.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

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

TEST_F(Dicom, aSliceCutOffInItsFolder) {
  const std::string folder = series();
  writeBytes(folder + "/README1", "what is named otherwise is passed over");
  EXPECT_NO_THROW(readVolume(folder));
  // The first slice, so that it is not missing between others.
  const std::string path = folder + "/IM50";
  const std::string whole = readBytes(path);
  for (const size_t length : {size_t(0), size_t(100), size_t(131)}) {
    writeBytes(path, whole.substr(0, length));
    EXPECT_EQ(inputError([&] { readVolume(folder); }),
              path + ": is named like the DICOM files beside it, but is none; it may be cut short");
  }
  for (const size_t length : {size_t(132), size_t(300), whole.size() - 1}) {
    writeBytes(path, whole.substr(0, length));
    EXPECT_THROW(readVolume(folder), InputError) << length;
  }
}

TEST_F(Dicom, lyingHeaders) {
  const auto error = [](const std::function<void(DicomSlice&)>& change) {
    DicomSlice slice;
    change(slice);
    return inputError([&] { readVolume(fileOf(slice.bytes(), "a.dcm")); });
  };
  // More pixels than there are, fewer, and more than any machine has.
  EXPECT_NE(error([](DicomSlice& s) { s.rows = 8; }).find("expected 80 bytes of pixels"), std::string::npos);
  EXPECT_NE(error([](DicomSlice& s) { s.rows = 6; }).find("expected 60 bytes of pixels"), std::string::npos);
  EXPECT_NE(error([](DicomSlice& s) { s.rows = s.columns = 65535; }), "");
  EXPECT_NE(error([](DicomSlice& s) { s.frames = "2147483647"; }), "");
  EXPECT_NE(error([](DicomSlice& s) { s.columns = 0; }), "");
  EXPECT_NE(error([](DicomSlice& s) { s.pixelSpacing = "-0.5\\0.25"; }).find("expected a positive pixel spacing"),
            std::string::npos);
  EXPECT_NE(error([](DicomSlice& s) { s.pixelSpacing = "0\\0.25"; }).find("expected a positive pixel spacing"),
            std::string::npos);
}

}  // namespace freevoxel::test
