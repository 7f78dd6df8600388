#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::numpy_tests {

namespace {

std::string npy(const std::string& type, const std::string& shape, const std::string& values, bool fortran = false,
                int version = 1) {
  std::string text =
      "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" + shape + "), }";
  text.resize(118, ' ');
  text.back() = '\n';
  Bytes bytes;
  bytes.text("\x93NUMPY").add(uint8_t(version)).add(uint8_t(0));
  if (version == 1) {
    bytes.add(uint16_t(text.size()));
  } else {
    bytes.add(uint32_t(text.size()));
  }
  return bytes.text(text).text(values).str();
}

const std::string kBytes = testBytes(ValueType::u8, ByteOrder::little);

std::string error(const std::string& content) {
  const std::string path = fileOf(content, "v.npy");
  return inputError([&] { readVolume(path); }).substr(path.size() + 2);
}

/// The values of kDims voxels with z fastest.
std::string fortranOrder() {
  std::string values;
  for (int x = 0; x < kDims.x; ++x) {
    for (int y = 0; y < kDims.y; ++y) {
      for (int z = 0; z < kDims.z; ++z)
        values += kBytes[linearIndex({x, y, z}, kDims)];
    }
  }
  return values;
}

}  // namespace

TEST(Numpy, everyTypeInBothByteOrdersAndEveryVersion) {
  const std::vector<std::pair<ValueType, std::string>> names{
      {ValueType::u8, "u1"},  {ValueType::i8, "i1"},  {ValueType::u16, "u2"}, {ValueType::i16, "i2"},
      {ValueType::u32, "u4"}, {ValueType::i32, "i4"}, {ValueType::f32, "f4"}, {ValueType::f64, "f8"}};
  for (const auto& [type, name] : names) {
    const std::string little = testBytes(type, ByteOrder::little);
    for (const int version : {1, 2, 3}) {
      expectTestValues(readVolume(fileOf(npy("<" + name, "11, 7, 5", little, false, version), "v.npy")), type);
    }
    expectTestValues(readVolume(fileOf(npy(">" + name, "11, 7, 5", testBytes(type, ByteOrder::big)), "v.npy")), type);
    expectTestValues(readVolume(fileOf(gzip(npy("<" + name, "11, 7, 5", little)), "v.npy.gz")), type);
  }
}

TEST(Numpy, theArrayIsTheSameInFortranOrder) {
  const std::string content = npy("|u1", "11, 7, 5", fortranOrder(), true);
  expectTestValues(readVolume(fileOf(content, "v.npy")), ValueType::u8);
  const std::string path = fileOf(content, "v.npy");
  expectTruncationsFail(path, [&] { readVolume(path); });
}

TEST(Numpy, fourAxes) {
  std::string pairs;
  for (const char c : kBytes) {
    pairs += '?';
    pairs += c;
  }
  VolumeOptions last, first;
  last.component = "1";
  first.frame = 1;
  expectTestValues(readVolume(fileOf(npy("|u1", "11, 7, 5, 2", pairs), "v.npy"), last), ValueType::u8);
  const std::string frames = std::string(385, '?') + kBytes;
  expectTestValues(readVolume(fileOf(npy("|u1", "2, 11, 7, 5", frames), "v.npy"), first), ValueType::u8);
  // Contiguous the other way round: the last axis is the slowest.
  const std::string turned = std::string(385, '?') + fortranOrder();
  expectTestValues(readVolume(fileOf(npy("|u1", "11, 7, 5, 2", turned, true), "v.npy"), last), ValueType::u8);
  EXPECT_NE(error(npy("|u1", "2, 11, 7, 5", frames)).find("--component"), std::string::npos);
}

TEST(Numpy, everyTruncationFails) {
  const std::string path = fileOf(npy("|u1", "11, 7, 5", kBytes), "v.npy");
  expectTruncationsFail(path, [&] { readVolume(path); });
}

TEST(Numpy, whatCannotBeIsRefused) {
  EXPECT_EQ(error(npy("|u1", "11, 7, 5", kBytes, false, 4)), "offset 6: expected version 1, 2 or 3, found 4");
  EXPECT_EQ(error(npy("<c8", "11, 7, 5", kBytes)),
            "offset 10: expected a type such as '|u1', '<i2' or '<f4', found '<c8'");
  EXPECT_EQ(error(npy("|u1", "35, 11", kBytes)), "offset 10: expected an array of 3 axes [z][y][x], found 2");
  EXPECT_EQ(error(npy("|u1", "11, -7, 5", kBytes)), "offset 10: expected sizes in 1..2097152, found '-7'");
  EXPECT_NE(error(npy("<f8", "2097152, 2097152, 2097152", kBytes)).find("2^64"), std::string::npos);
  EXPECT_NE(error(npy("<f8", "2097152, 2097152, 16", kBytes, true)).find("found 385"), std::string::npos);
  EXPECT_NE(error(npy("|u1", "11, 7, 5", kBytes + "x")).find("found 386"), std::string::npos);
  EXPECT_NE(error("hello").find("expected a NumPy array"), std::string::npos);
}

}  // namespace freevoxel::test::numpy_tests
