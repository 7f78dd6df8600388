#include <gtest/gtest.h>

#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::dat_header_tests {

namespace {

const std::string kHeader = "ObjectFileName:\tv.raw\nResolution:\t5 7 11\nSliceThickness:\t1 2 0.5\n";

/// Path of a header with a raw file beside it.
std::string pairOf(const std::string& header, const std::string& raw) {
  const std::string folder = temporaryFolder() + "/";
  writeBytes(folder + "v.raw", raw);
  writeBytes(folder + "v.dat", header);
  return folder + "v.dat";
}

std::string error(const std::string& header) {
  const std::string path = pairOf(header, testBytes(ValueType::u8, ByteOrder::little));
  return inputError([&] { readVolume(path); }).substr(path.size() + 2);
}

}  // namespace

TEST(DatHeader, voreenAndInviwo) {
  for (const auto& [type, name] :
       {std::pair(ValueType::u8, "UCHAR"), {ValueType::u16, "USHORT"}, {ValueType::f32, "FLOAT"}}) {
    const std::string values = testBytes(type, ByteOrder::little);
    const Volume volume = readVolume(pairOf(kHeader + "Format: " + name + "\nObjectModel: I\n", values));
    expectTestValues(volume, type);
    EXPECT_EQ(volume.header.placement.spacing, glm::dvec3(1.0, 2.0, 0.5));
    expectTestValues(readVolume(pairOf(kHeader + "Format: " + name, gzip(values))), type);
  }
  const Volume inviwo =
      readVolume(pairOf("Rawfile: v.raw\nResolution: 5 7 11\nFormat: INT16\nByteOrder: BigEndian\nByteOffset: 3\n"
                        "BasisVector1: 10 0 0\nBasisVector2: 0 7 0\nBasisVector3: 0 0 33\nOffset: 1 2 3\n",
                        "abc" + testBytes(ValueType::i16, ByteOrder::big)));
  expectTestValues(inviwo, ValueType::i16);
  EXPECT_EQ(inviwo.header.placement.spacing, glm::dvec3(2.0, 1.0, 3.0));
  EXPECT_EQ(inviwo.header.placement.origin, glm::dvec3(2.0, 2.5, 4.5));
}

TEST(DatHeader, truncationsFail) {
  const std::string path = pairOf(kHeader + "Format: UCHAR", testBytes(ValueType::u8, ByteOrder::little));
  expectTruncationsFail(path, [&] { readVolume(path); });
  const std::string raw = path.substr(0, path.size() - 3) + "raw";
  expectTruncationsFail(raw, [&] { readVolume(path); });
}

TEST(DatHeader, errorsNameTheLine) {
  EXPECT_EQ(error(kHeader + "Format: COLOUR\n"),
            "line 4: expected UCHAR, USHORT, FLOAT or another format, found 'COLOUR'");
  EXPECT_EQ(error(kHeader), "the header has no field 'format'");
  EXPECT_NE(error(kHeader + "Format: USHORT\n").find("expected 770 bytes"), std::string::npos);
  EXPECT_EQ(error("ObjectFileName: v.raw\nResolution: 5 7 11\nFormat: UCHAR\nSliceThickness: 1 -1 1\n"),
            "line 4: expected a positive spacing, found -1");
  EXPECT_NE(error("ObjectFileName: gone.raw\nResolution: 5 7 11\nFormat: UCHAR\n").find("line 1: data file"),
            std::string::npos);
  EXPECT_NE(error(kHeader + "ObjectFileName: b.raw\n").find("line 4: several data files"), std::string::npos);
}

}  // namespace freevoxel::test::dat_header_tests
