#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::nifti_tests {

namespace {

/// A header of 352 or 544 bytes with the dims of the tests.
Bytes nifti1(ByteOrder order, int16_t type, int16_t bits, std::vector<int16_t> dim = {3, 5, 7, 11, 1, 1, 1, 1}) {
  Bytes bytes(order);
  bytes.zeros(352).put<int32_t>(0, 348).put<int16_t>(70, type).put<int16_t>(72, bits).put<float>(108, 352.0f);
  for (size_t i = 0; i < 8; ++i)
    bytes.put<int16_t>(40 + 2 * i, dim[i]).put<float>(76 + 4 * i, 1.0f);
  return bytes.put<uint32_t>(344, order == ByteOrder::little ? 0x00312b6eu : 0x6e2b3100u);
}

Bytes nifti2(ByteOrder order, int16_t type, int16_t bits) {
  const int64_t dim[] = {3, 5, 7, 11, 1, 1, 1, 1};
  Bytes bytes(order);
  bytes.zeros(544).put<int32_t>(0, 540).put<int16_t>(12, type).put<int16_t>(14, bits).put<int64_t>(168, 544);
  for (size_t i = 0; i < 8; ++i)
    bytes.put<int64_t>(16 + 8 * i, dim[i]).put<double>(104 + 8 * i, 1.0);
  return bytes.put<uint32_t>(4, order == ByteOrder::little ? 0x00322b6eu : 0x6e2b3200u);
}

const std::string kBytes = testBytes(ValueType::u8, ByteOrder::little);

std::string error(const std::string& content) {
  const std::string path = fileOf(content, "v.nii");
  return inputError([&] { readVolume(path); }).substr(path.size() + 2);
}

}  // namespace

TEST(Nifti, everyTypeInBothByteOrdersAndVersions) {
  const std::vector<std::pair<ValueType, int16_t>> codes{
      {ValueType::u8, 2},    {ValueType::i8, 256}, {ValueType::u16, 512}, {ValueType::i16, 4},
      {ValueType::u32, 768}, {ValueType::i32, 8},  {ValueType::f32, 16},  {ValueType::f64, 64}};
  for (const auto& [type, code] : codes) {
    const auto bits = int16_t(8 * bytesPerValue(type));
    for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
      const std::string values = testBytes(type, order);
      expectTestValues(readVolume(fileOf(nifti1(order, code, bits).str() + values, "v.nii")), type);
      expectTestValues(readVolume(fileOf(nifti2(order, code, bits).str() + values, "v.nii")), type);
      expectTestValues(readVolume(fileOf(gzip(nifti1(order, code, bits).str() + values), "v.nii.gz")), type);
    }
  }
}

TEST(Nifti, valuesAreScaled) {
  Bytes header = nifti1(ByteOrder::big, 2, 8);
  header.put<float>(112, 0.5f).put<float>(116, -3.0f);
  const Volume volume = readVolume(fileOf(header.str() + kBytes, "v.nii"));
  EXPECT_EQ(volume.header.type, ValueType::f32);
  EXPECT_EQ(volume.value(11), 0.5 * 11 - 3.0);
  // 0 is not a slope but the absence of one, whatever the intercept.
  header.put<float>(112, 0.0f);
  expectTestValues(readVolume(fileOf(header.str() + kBytes, "v.nii")), ValueType::u8);
  header.put<float>(112, NAN);
  expectTestValues(readVolume(fileOf(header.str() + kBytes, "v.nii")), ValueType::u8);
}

TEST(Nifti, headerAndImageApart) {
  Bytes header = nifti1(ByteOrder::little, 2, 8);
  header.put<uint32_t>(344, 0x0031696eu).put<float>(108, 0.0f);
  const std::string folder = temporaryFolder() + "/";
  writeBytes(folder + "v.hdr", header.str().substr(0, 348));
  EXPECT_NE(inputError([&] { readVolume(folder + "v.hdr"); }).find("v.img, which does not exist"), std::string::npos);
  writeBytes(folder + "v.img", kBytes);
  expectTestValues(readVolume(folder + "v.hdr"), ValueType::u8);
  expectTruncationsFail(folder + "v.img", [&] { readVolume(folder + "v.hdr"); });
}

TEST(Nifti, framesAndComponents) {
  const Bytes header = nifti1(ByteOrder::little, 2, 8, {5, 5, 7, 11, 2, 3, 1, 1});
  const std::string other(385, '?');
  const std::string path = fileOf(header.str() + other + other + other + kBytes + other + other, "v.nii");
  EXPECT_NE(inputError([&] { readVolume(path); }).find("--component"), std::string::npos);
  VolumeOptions options;
  options.component = "1";
  EXPECT_NE(inputError([&] { readVolume(path, options); }).find("--frame 0 to 1"), std::string::npos);
  options.frame = 1;
  expectTestValues(readVolume(path, options), ValueType::u8);
  expectTruncationsFail(path, [&] { readVolume(path, options); });
}

TEST(Nifti, everyTruncationFails) {
  for (const std::string& content :
       {nifti1(ByteOrder::big, 2, 8).str() + kBytes, nifti2(ByteOrder::big, 2, 8).str() + kBytes,
        gzip(nifti1(ByteOrder::little, 2, 8).str() + kBytes)}) {
    const std::string path = fileOf(content, "v.nii");
    expectTruncationsFail(path, [&] { readVolume(path); });
  }
}

TEST(Nifti, whatCannotBeIsRefused) {
  const auto with = [](auto change) {
    Bytes header = nifti1(ByteOrder::little, 2, 8);
    change(header);
    return error(header.str() + kBytes);
  };
  EXPECT_EQ(error("hello"), "offset 0: expected a header of 348 or 540 bytes");
  EXPECT_EQ(with([](Bytes& b) { b.put<int16_t>(70, 128); }),
            "offset 70: expected a data type of plain numbers, found code 128 (colour)");
  EXPECT_EQ(with([](Bytes& b) { b.put<int16_t>(72, 16); }),
            "offset 72: expected 8 bits per value for data type 2, found 16");
  EXPECT_EQ(with([](Bytes& b) { b.put<int16_t>(40, 2); }), "offset 40: expected 3 to 5 dimensions, found 2");
  EXPECT_EQ(with([](Bytes& b) { b.put<int16_t>(44, -7); }),
            "offset 40: expected a size of axis 2 in 1..2097152, found -7");
  EXPECT_NE(with([](Bytes& b) { b.put<int16_t>(44, 30000); }).find("expected 1650000 bytes"), std::string::npos);
  EXPECT_EQ(with([](Bytes& b) { b.put<float>(80, -1.0f); }),
            "offset 76: expected a positive spacing of axis x, found -1");
  EXPECT_EQ(with([](Bytes& b) { b.put<float>(80, NAN); }),
            "offset 76: expected a positive spacing of axis x, found nan");
  EXPECT_EQ(with([](Bytes& b) { b.put<float>(108, 100.0f); }),
            "offset 108: expected values from byte 352 on or later, found 100");
  EXPECT_NE(with([](Bytes& b) { b.put<int16_t>(254, 1); }).find("offset 280: expected a voxel edge of positive length"),
            std::string::npos);
  EXPECT_EQ(with([](Bytes& b) {
              b.put<int16_t>(254, 1);
              for (const size_t offset : {280, 300, 324})
                b.put<float>(offset, 1.0f);
              b.put<float>(316, 0.0f).put<float>(320, 1.0f).put<float>(324, 0.0f);
              b.put<float>(312, 0.0f).put<float>(284, 0.0f).put<float>(296, 0.0f).put<float>(320, 0.0f).put<float>(
                  304, 2.0f);
            }),
            "offset 280: expected three axes that do not lie in one plane");
  EXPECT_NE(error(nifti1(ByteOrder::little, 2, 8).str() + kBytes + "x").find("found 386"), std::string::npos);
}

}  // namespace freevoxel::test::nifti_tests
