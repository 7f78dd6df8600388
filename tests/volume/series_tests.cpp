// Names with a number in them, and frames chosen by it.
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "volume/file_pattern.h"

namespace freevoxel::test {

TEST(Series, patterns) {
  EXPECT_EQ(expandPattern("a%d.raw", 7), "a7.raw");
  EXPECT_EQ(expandPattern("a%04d%%.raw", 7), "a0007%.raw");
  EXPECT_EQ(expandPattern("a%3d", 7), "a  7");
  EXPECT_EQ(expandPattern("a.raw", 7), std::nullopt);
  EXPECT_EQ(expandPattern("a%s", 7), std::nullopt);
  EXPECT_EQ(expandPattern("a%d%d", 7), std::nullopt);
}

TEST(Series, naturalOrder) {
  EXPECT_TRUE(naturallyBefore("s2", "s10"));
  EXPECT_FALSE(naturallyBefore("s10", "s2"));
  EXPECT_TRUE(naturallyBefore("s002b", "s10a"));
  EXPECT_TRUE(naturallyBefore("a", "b"));
  EXPECT_TRUE(naturallyBefore("s", "s1"));
  EXPECT_FALSE(naturallyBefore("s1", "s1"));
}

TEST(Series, aFrameOfAPattern) {
  const std::string folder = temporaryFolder() + "/";
  const std::string header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 7 11\nencoding: raw\n\n";
  for (const int number : {3, 4, 12})
    writeBytes(fmt::format("{}frame_{:04}.nrrd", folder, number), header + std::string(385, char('a' + number)));
  writeBytes(folder + "frame_0004.nrrd", header + testBytes(ValueType::u8, ByteOrder::little));
  const std::string pattern = folder + "frame_%04d.nrrd";
  VolumeOptions options;
  EXPECT_EQ(inputError([&] { readVolume(pattern); }),
            pattern + ": names several volumes; choose one with --frame 3 to 12");
  options.frame = 4;
  expectTestValues(readVolume(pattern, options), ValueType::u8);
  options.frame = 5;
  EXPECT_NE(inputError([&] { readVolume(pattern, options); }).find("there is no file"), std::string::npos);
  EXPECT_NE(inputError([&] { readVolume(folder + "gone_%d.nrrd", options); }).find("no file of that pattern"),
            std::string::npos);
}

TEST(Series, labelsAreWholeNumbers) {
  VolumeOptions options;
  options.labels = true;
  const std::string start = "NRRD0004\ndimension: 3\nsizes: 5 7 11\nencoding: raw\nendian: little\ntype: ";
  const Volume volume =
      readVolume(fileOf(start + "uchar\n\n" + testBytes(ValueType::u8, ByteOrder::little), "v.nrrd"), options);
  EXPECT_TRUE(volume.header.labels);
  const std::string floats = fileOf(start + "float\n\n" + testBytes(ValueType::f32, ByteOrder::little), "v.nrrd");
  EXPECT_NE(inputError([&] { readVolume(floats, options); }).find("labels are whole numbers"), std::string::npos);
}

}  // namespace freevoxel::test
