#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::meta_image_tests {

namespace {

const std::string kStart = "ObjectType = Image\nNDims = 3\nDimSize = 5 7 11\n";
const std::string kBytes = testBytes(ValueType::u8, ByteOrder::little);
const std::string kLocal = "ElementDataFile = LOCAL\n";

Volume readText(const std::string& content, const VolumeOptions& options = {}) {
  return readVolume(fileOf(content, "v.mha"), options);
}

std::string error(const std::string& content) {
  const std::string path = fileOf(content, "v.mha");
  return inputError([&] { readVolume(path); }).substr(path.size() + 2);
}

}  // namespace

TEST(MetaImage, everyTypeInBothByteOrdersRawAndCompressed) {
  const std::vector<std::pair<ValueType, std::string>> names{
      {ValueType::u8, "MET_UCHAR"},  {ValueType::i8, "MET_CHAR"},   {ValueType::u16, "MET_USHORT"},
      {ValueType::i16, "MET_SHORT"}, {ValueType::u32, "MET_UINT"},  {ValueType::i32, "MET_INT"},
      {ValueType::f32, "MET_FLOAT"}, {ValueType::f64, "MET_DOUBLE"}};
  for (const auto& [type, name] : names) {
    const std::string element = kStart + "ElementType = " + name + "\n";
    const std::string big = testBytes(type, ByteOrder::big);
    expectTestValues(readText(element + kLocal + testBytes(type, ByteOrder::little)), type);
    expectTestValues(readText(element + "BinaryDataByteOrderMSB = True\n" + kLocal + big), type);
    expectTestValues(readText(element + "ElementByteOrderMSB = True\nCompressedData = True\nCompressedDataSize = 3\n" +
                              kLocal + gzip(big)),
                     type);
  }
}

TEST(MetaImage, valuesElsewhere) {
  const std::string header = kStart + "ElementType = MET_UCHAR\nElementDataFile = ";
  const std::string folder = temporaryFolder() + "/";
  writeBytes(folder + "v.raw", "head" + kBytes);
  writeBytes(folder + "one.mhd", kStart + "ElementType = MET_UCHAR\nHeaderSize = 4\nElementDataFile = v.raw\n");
  expectTestValues(readVolume(folder + "one.mhd"), ValueType::u8);
  writeBytes(folder + "end.mhd", kStart + "ElementType = MET_UCHAR\nHeaderSize = -1\nElementDataFile = v.raw");
  expectTestValues(readVolume(folder + "end.mhd"), ValueType::u8);
  std::string names;
  for (int z = 0; z < 11; ++z) {
    writeBytes(fmt::format("{}s{:02}", folder, 2 * z), kBytes.substr(size_t(z) * 35, 35));
    names += fmt::format("s{:02}\n", 2 * z);
  }
  writeBytes(folder + "list.mhd", header + "LIST\n" + names);
  writeBytes(folder + "pattern.mhd", header + "s%02d 0 20 2\n");
  expectTestValues(readVolume(folder + "list.mhd"), ValueType::u8);
  expectTestValues(readVolume(folder + "pattern.mhd"), ValueType::u8);
  expectTruncationsFail(folder + "s08", [&] { readVolume(folder + "list.mhd"); });
  writeBytes(folder + "gone.mhd", header + "LIST\n" + names + "s99\n");
  EXPECT_NE(inputError([&] { readVolume(folder + "gone.mhd"); }).find("line 17: data file"), std::string::npos);
}

TEST(MetaImage, text) {
  std::string numbers;
  for (const char c : kBytes)
    numbers += std::to_string(int(uint8_t(c))) + " ";
  const std::string path = fileOf(kStart + "BinaryData = False\nElementType = MET_UCHAR\n" + kLocal + numbers, "v.mha");
  expectTestValues(readVolume(path), ValueType::u8);
  expectTruncationsFail(path, [&] { readVolume(path); });
}

TEST(MetaImage, channelsAndFrames) {
  std::string pairs;
  for (const char c : kBytes) {
    pairs += c;
    pairs += '?';
  }
  const std::string header = kStart + "ElementNumberOfChannels = 2\nElementType = MET_UCHAR_ARRAY\n" + kLocal;
  EXPECT_NE(error(header + pairs).find("choose one with --component"), std::string::npos);
  VolumeOptions options;
  options.component = "0";
  expectTestValues(readText(header + pairs, options), ValueType::u8);
  VolumeOptions frame;
  frame.frame = 1;
  const std::string four = "NDims = 4\nDimSize = 5 7 11 2\nElementType = MET_UCHAR\n" + kLocal;
  expectTestValues(readText(four + std::string(385, '?') + kBytes, frame), ValueType::u8);
}

TEST(MetaImage, everyTruncationFails) {
  for (const std::string& content :
       {kStart + "ElementType = MET_UCHAR\n" + kLocal + kBytes,
        kStart + "CompressedData = True\nElementType = MET_UCHAR\n" + kLocal + gzip(kBytes)}) {
    const std::string path = fileOf(content, "v.mha");
    expectTruncationsFail(path, [&] { readVolume(path); });
  }
}

TEST(MetaImage, errorsNameTheLine) {
  const std::string type = "ElementType = MET_UCHAR\n";
  EXPECT_NE(error(kStart + type + kLocal + kBytes + "x").find("found 386"), std::string::npos);
  EXPECT_EQ(error(kStart + type), "the header has no key 'ElementDataFile'");
  EXPECT_EQ(error("ObjectType = Mesh\n" + kLocal), "line 1: expected ObjectType = Image, found 'Mesh'");
  EXPECT_EQ(error("NDims = 2\nDimSize = 5 7\n" + type + kLocal), "line 1: expected a number in 3..4, found '2'");
  EXPECT_EQ(error("NDims = 3\nDimSize = 5 7\n" + type + kLocal), "line 2: expected 3 sizes, found '5 7'");
  EXPECT_EQ(error("NDims = 3\nDimSize = 5 0 7\n" + type + kLocal), "line 2: expected a size in 1..2097152, found '0'");
  EXPECT_EQ(error("NDims = 3\nDimSize = 2097152 2097152 2097152\nElementType = MET_DOUBLE\n" + kLocal),
            "2097152 x 2097152 x 2097152 values of type f64 are more than 2^64 bytes");
  EXPECT_EQ(error(kStart + type + "ElementSpacing = 1 -2 1\n" + kLocal + kBytes),
            "line 5: expected a positive spacing, found -2");
  EXPECT_EQ(error(kStart + type + "TransformMatrix = 1 0 0 1 0 0 0 0 1\n" + kLocal + kBytes),
            "line 5: expected three axes that do not lie in one plane");
  EXPECT_EQ(error(kStart + "ElementType = MET_COLOUR\n" + kLocal),
            "line 4: expected MET_UCHAR, MET_SHORT, MET_FLOAT or another, found 'MET_COLOUR'");
  EXPECT_EQ(error(kStart + type + "CompressedData = Perhaps\n" + kLocal),
            "line 5: expected True or False, found 'Perhaps'");
  EXPECT_NE(error(kStart + type + "ElementDataFile = gone.raw\n").find("line 5: data file"), std::string::npos);
}

}  // namespace freevoxel::test::meta_image_tests
