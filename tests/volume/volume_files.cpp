#include "tests/volume/volume_files.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "base/error.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {

namespace {

template <class T>
void append(std::string& bytes, double value, ByteOrder order) {
  const T typed = T(value);
  char raw[sizeof(T)];
  std::memcpy(raw, &typed, sizeof(T));
  const bool isNative = (order == ByteOrder::little) == (std::endian::native == std::endian::little);
  if (!isNative) std::reverse(raw, raw + sizeof(T));
  bytes.append(raw, sizeof(T));
}

std::string deflated(const std::string& bytes, int windowBits) {
  z_stream stream{};
  deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, windowBits, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, uLong(bytes.size())) + 64, '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = uInt(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

}  // namespace

double testValue(ValueType type, uint64_t linear) {
  const auto i = double(linear);
  switch (type) {
    case ValueType::u8:
      return double(linear % 256);
    case ValueType::i8:
      return double(linear % 256) - 128.0;
    case ValueType::u16:
      return 65535.0 - 3.0 * i;
    case ValueType::i16:
      return -32768.0 + 7.0 * i;
    case ValueType::u32:
      return 4294967295.0 - 1000003.0 * i;
    case ValueType::i32:
      return -2147483648.0 + 1000003.0 * i;
    case ValueType::f32:
      return -1.5 + 0.015625 * i;
    case ValueType::f64:
      break;
  }
  return 1.0 / (1.0 + i) - 0.3;
}

std::string testBytes(ValueType type, ByteOrder order) {
  std::string bytes;
  for (uint64_t i = 0; i < voxelCount(kDims); ++i) {
    const double value = testValue(type, i);
    switch (type) {
      case ValueType::u8:
        append<uint8_t>(bytes, value, order);
        break;
      case ValueType::i8:
        append<int8_t>(bytes, value, order);
        break;
      case ValueType::u16:
        append<uint16_t>(bytes, value, order);
        break;
      case ValueType::i16:
        append<int16_t>(bytes, value, order);
        break;
      case ValueType::u32:
        append<uint32_t>(bytes, value, order);
        break;
      case ValueType::i32:
        append<int32_t>(bytes, value, order);
        break;
      case ValueType::f32:
        append<float>(bytes, value, order);
        break;
      case ValueType::f64:
        append<double>(bytes, value, order);
        break;
    }
  }
  return bytes;
}

void expectTestValues(const Volume& volume, ValueType type) {
  ASSERT_EQ(volume.header.dims, kDims);
  ASSERT_EQ(volume.header.type, type);
  ASSERT_EQ(volume.data.size(), volume.header.bytes());
  for (uint64_t i = 0; i < volume.header.voxels(); ++i)
    ASSERT_EQ(volume.value(i), testValue(type, i)) << "voxel " << i;
}

std::string gzip(const std::string& bytes) {
  return deflated(bytes, 15 + 16);
}

std::string zlibStream(const std::string& bytes) {
  return deflated(bytes, 15);
}

std::string inputError(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    return text;
  }
  ADD_FAILURE() << "expected an InputError";
  return {};
}

std::string fileOf(const std::string& bytes, const std::string& name) {
  const std::string path = temporaryFolder() + "/" + name;
  writeBytes(path, bytes);
  return path;
}

TestReader::TestReader() : before_(childProgram()) {
  childProgram().path = FREEVOXEL_TEST_READER;
  childProgram().limits.silentSeconds = 20;
}

TestReader::~TestReader() {
  childProgram() = before_;
}

void expectTruncationsFail(const std::string& path, const std::function<void()>& read) {
  const std::string whole = readBytes(path);
  EXPECT_NO_THROW(read());
  for (size_t length = 0; length < whole.size(); ++length) {
    writeBytes(path, whole.substr(0, length));
    EXPECT_THROW(read(), InputError) << path << " cut to " << length << " of " << whole.size() << " bytes";
  }
  writeBytes(path, whole);
}

}  // namespace freevoxel::test
