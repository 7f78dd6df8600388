#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

VolumeOptions options(ValueType type, ByteOrder order = ByteOrder::little, uint64_t skip = 0) {
  VolumeOptions raw;
  raw.dims = kDims;
  raw.type = type;
  raw.byteOrder = order;
  raw.skip = skip;
  return raw;
}

}  // namespace

TEST(Raw, everyTypeInBothByteOrders) {
  for (const ValueType type : kAllTypes) {
    for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
      const std::string bytes = testBytes(type, order);
      expectTestValues(readVolume(fileOf(bytes, "volume.raw"), options(type, order)), type);
      expectTestValues(readVolume(fileOf(gzip(bytes), "volume.raw"), options(type, order)), type);
    }
  }
}

TEST(Raw, skipCountsUnpackedBytes) {
  const std::string bytes = "some header" + testBytes(ValueType::i16, ByteOrder::big);
  expectTestValues(readVolume(fileOf(bytes, "volume.raw"), options(ValueType::i16, ByteOrder::big, 11)),
                   ValueType::i16);
  expectTestValues(readVolume(fileOf(gzip(bytes), "volume.raw"), options(ValueType::i16, ByteOrder::big, 11)),
                   ValueType::i16);
}

TEST(Raw, spacingIsTakenAndOriginIsZero) {
  VolumeOptions raw = options(ValueType::u8);
  raw.spacing = glm::dvec3(0.5, 0.75, 2.0);
  const Volume volume = readVolume(fileOf(testBytes(ValueType::u8, ByteOrder::little), "volume.raw"), raw);
  EXPECT_EQ(volume.header.placement.spacing, glm::dvec3(0.5, 0.75, 2.0));
  EXPECT_EQ(volume.header.placement.origin, glm::dvec3(0.0));
  raw.spacing = glm::dvec3(0.5, 0.0, 2.0);
  EXPECT_THROW(readVolume(fileOf(testBytes(ValueType::u8, ByteOrder::little), "volume.raw"), raw), InputError);
}

TEST(Raw, severalGzipMembersAreOneStream) {
  const std::string bytes = testBytes(ValueType::f32, ByteOrder::little);
  const std::string path = fileOf(gzip(bytes.substr(0, 100)) + gzip("") + gzip(bytes.substr(100)), "volume.raw");
  expectTestValues(readVolume(path, options(ValueType::f32)), ValueType::f32);
}

TEST(Raw, slicesInAnyPortionsAreTheWhole) {
  const std::string path = fileOf(gzip(testBytes(ValueType::u16, ByteOrder::big)), "volume.raw");
  const Volume whole = readVolume(path, options(ValueType::u16, ByteOrder::big));
  const auto source = openVolume(path, options(ValueType::u16, ByteOrder::big));
  const size_t sliceBytes = size_t(kDims.x) * size_t(kDims.y) * 2;
  std::vector<std::byte> data(whole.data.size());
  size_t at = 0;
  for (const int count : {1, 0, 4, 6}) {
    source->readSlices(count, std::span(data).subspan(at, size_t(count) * sliceBytes));
    at += size_t(count) * sliceBytes;
  }
  EXPECT_EQ(data, whole.data);
  std::vector<std::byte> slice(sliceBytes);
  EXPECT_THROW(source->readSlices(1, slice), InternalError);
}

TEST(Raw, everyTruncationFails) {
  const std::string bytes = testBytes(ValueType::u8, ByteOrder::little);
  for (const std::string& content : {bytes, "skipped" + bytes, gzip("skipped" + bytes),
                                     gzip("skipped" + bytes.substr(0, 99)) + gzip(bytes.substr(99))}) {
    const std::string path = fileOf(content, "volume.raw");
    const uint64_t skip = content == bytes ? 0 : 7;
    expectTruncationsFail(path, [&] { readVolume(path, options(ValueType::u8, ByteOrder::little, skip)); });
  }
}

TEST(Raw, whatIsLeftOverIsAnError) {
  const std::string bytes = testBytes(ValueType::u8, ByteOrder::little) + "x";
  const std::string plain = fileOf(bytes, "volume.raw");
  EXPECT_EQ(inputError([&] { openVolume(plain, options(ValueType::u8)); }),
            plain +
                ": expected 385 bytes (5 x 7 x 11 values of type u8) from byte 0 on, found 386; check --dims, --type "
                "and --skip");
  const std::string packed = fileOf(gzip(bytes), "volume.raw");
  EXPECT_EQ(inputError([&] { readVolume(packed, options(ValueType::u8)); }),
            packed +
                ": expected 385 bytes (5 x 7 x 11 values of type u8), the stream goes on after them; check --dims, "
                "--type and --skip");
  const std::string trailed = fileOf(gzip(bytes.substr(0, 385)) + "trailing", "volume.raw");
  EXPECT_NE(inputError([&] { readVolume(trailed, options(ValueType::u8)); }).find("damaged before byte"),
            std::string::npos);
}

TEST(Raw, everyChangedByteOfAStreamIsFound) {
  const std::string packed = gzip(testBytes(ValueType::u8, ByteOrder::little));
  const Volume right = readVolume(fileOf(packed, "volume.raw"), options(ValueType::u8));
  const std::string path = fileOf(packed, "volume.raw");
  for (size_t i = 0; i < packed.size(); ++i) {
    std::string damaged = packed;
    damaged[i] = char(damaged[i] ^ 0x55);
    writeBytes(path, damaged);
    // Flags, time and system in the header (bytes 3 to 9) say nothing about the values.
    try {
      EXPECT_EQ(readVolume(path, options(ValueType::u8)).data, right.data) << "byte " << i;
      EXPECT_TRUE(i >= 3 && i <= 9) << "byte " << i;
    } catch (const InputError&) {
    }
  }
}

TEST(Raw, sizesThatCannotBeAreRefusedBeforeAnythingIsAllocated) {
  const std::string plain = fileOf(testBytes(ValueType::u8, ByteOrder::little), "volume.raw");
  const std::string packed = fileOf(gzip(testBytes(ValueType::u8, ByteOrder::little)), "volume.raw");
  VolumeOptions raw = options(ValueType::f64);
  for (const glm::ivec3 dims : {glm::ivec3(kMaxDim), glm::ivec3(kMaxDim, kMaxDim, 1), glm::ivec3(0, 7, 11),
                                glm::ivec3(5, -7, 11), glm::ivec3(5, 7, kMaxDim + 1), glm::ivec3(1000, 1000, 1000)}) {
    raw.dims = dims;
    EXPECT_THROW(openVolume(plain, raw), InputError);
    EXPECT_THROW(openVolume(packed, raw), InputError);
  }
  raw = options(ValueType::u8, ByteOrder::little, UINT64_MAX);
  EXPECT_THROW(openVolume(plain, raw), InputError);
  EXPECT_THROW(openVolume(packed, raw), InputError);
}

TEST(Raw, filesThatAreNoneAreErrors) {
  EXPECT_NE(inputError([] { openVolume("/nonexistent/a.raw", options(ValueType::u8)); }).find("cannot open"),
            std::string::npos);
  EXPECT_NE(inputError([] { openVolume("/dev/null", options(ValueType::u8)); }).find("not a regular file"),
            std::string::npos);
  EXPECT_THROW(openVolume(fileOf("", "volume.raw"), options(ValueType::u8)), InputError);
}

TEST(Raw, withoutDimsSaysWhatIsMissing) {
  const std::string path = fileOf(testBytes(ValueType::u8, ByteOrder::little), "volume.raw");
  EXPECT_NE(inputError([&] { openVolume(path); }).find("needs --dims X,Y,Z and --type"), std::string::npos);
}

}  // namespace freevoxel::test
