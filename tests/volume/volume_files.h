// Small volume files for the reader tests. Never a cube: 5 x 7 x 11.
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "volume/child_reader.h"
#include "volume/read_volume.h"

namespace freevoxel::test {

inline constexpr glm::ivec3 kDims{5, 7, 11};

/// A value that differs from voxel to voxel and, for the type, in every byte.
double testValue(ValueType type, uint64_t linear);
/// The values of kDims voxels as a file holds them.
std::string testBytes(ValueType type, ByteOrder order);
/// Fails the test where a volume does not hold testValue throughout.
void expectTestValues(const Volume& volume, ValueType type);

std::string gzip(const std::string& bytes);
std::string zlibStream(const std::string& bytes);

/// The text of the InputError that `action` throws; fails the test if it throws none, or if the text is not one line.
std::string inputError(const std::function<void()>& action);

/// Writes every truncation of `bytes` to `path` and expects reading (`read`) to end in an InputError. Puts the file
/// back.
void expectTruncationsFail(const std::string& path, const std::function<void()>& read);

/// A file of that content in a fresh folder.
std::string fileOf(const std::string& bytes, const std::string& name);

/// Bytes put together by hand.
class Bytes {
 public:
  explicit Bytes(ByteOrder order = ByteOrder::little) : order_(order) {}
  template <class T>
  Bytes& add(T value) {
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    const bool native = (order_ == ByteOrder::little) == (std::endian::native == std::endian::little);
    if (!native) std::reverse(raw, raw + sizeof(T));
    text_.append(raw, sizeof(T));
    return *this;
  }
  Bytes& zeros(size_t count) {
    text_.append(count, '\0');
    return *this;
  }
  Bytes& text(const std::string& text) {
    text_ += text;
    return *this;
  }
  /// Overwrites.
  template <class T>
  Bytes& put(size_t offset, T value) {
    text_.replace(offset, sizeof(T), Bytes(order_).add(value).str());
    return *this;
  }
  const std::string& str() const { return text_; }

 private:
  ByteOrder order_;
  std::string text_;
};

/// Has files read with libraries by the tests' own program, with limits fit for tests, until it is gone.
class TestReader {
 public:
  TestReader();
  ~TestReader();

 private:
  ChildProgram before_;
};

inline const std::vector<ValueType> kAllTypes{ValueType::u8,  ValueType::i8,  ValueType::u16, ValueType::i16,
                                              ValueType::u32, ValueType::i32, ValueType::f32, ValueType::f64};

}  // namespace freevoxel::test
