#include "volume/stored_values.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "base/error.h"

namespace freevoxel {

namespace {

template <class T>
void swapEach(std::span<std::byte> bytes) {
  for (size_t i = 0; i + sizeof(T) <= bytes.size(); i += sizeof(T)) {
    T value;
    std::memcpy(&value, bytes.data() + i, sizeof(T));
    if constexpr (sizeof(T) == 2) value = __builtin_bswap16(value);
    if constexpr (sizeof(T) == 4) value = __builtin_bswap32(value);
    if constexpr (sizeof(T) == 8) value = __builtin_bswap64(value);
    std::memcpy(bytes.data() + i, &value, sizeof(T));
  }
}

bool isNative(ByteOrder order) {
  return (order == ByteOrder::little) == (std::endian::native == std::endian::little);
}

template <class T>
T loadValue(const std::byte* at, bool native) {
  std::byte raw[sizeof(T)];
  for (size_t i = 0; i < sizeof(T); ++i)
    raw[i] = at[native ? i : sizeof(T) - 1 - i];
  return std::bit_cast<T>(raw);
}

/// A half as a type of its own, so that templates can tell it from an unsigned integer.
struct Half {
  uint16_t bits;
};

template <class From>
double asDouble(From value) {
  if constexpr (std::is_same_v<From, Half>) {
    return double(floatFromHalf(value.bits));
  } else {
    return double(value);
  }
}

template <class From, class To>
void convertEach(std::span<const std::byte> stored, bool native, Interleaved interleaved, Scaling scaling,
                 std::span<std::byte> out) {
  const size_t stride = sizeof(From) * size_t(interleaved.count);
  const std::byte* from = stored.data() + sizeof(From) * size_t(interleaved.chosen);
  for (size_t i = 0; i < out.size(); i += sizeof(To), from += stride) {
    const From value = loadValue<From>(from, native);
    To kept;
    if constexpr (std::is_same_v<From, To>) {
      kept = scaling.isNone() ? value : To(scaling.slope * double(value) + scaling.intercept);
    } else {
      kept = To(scaling.slope * asDouble(value) + scaling.intercept);
    }
    std::memcpy(out.data() + i, &kept, sizeof(To));
  }
}

template <class From>
void convertFrom(std::span<const std::byte> stored, bool native, Interleaved interleaved, Scaling scaling,
                 ValueType type, std::span<std::byte> out) {
  if (type == ValueType::f32) return convertEach<From, float>(stored, native, interleaved, scaling, out);
  if constexpr (std::is_same_v<From, uint64_t> || std::is_same_v<From, int64_t>) {
    return convertEach<From, double>(stored, native, interleaved, scaling, out);
  } else if constexpr (!std::is_same_v<From, Half> && !std::is_same_v<From, float>) {
    return convertEach<From, From>(stored, native, interleaved, scaling, out);
  }
}

}  // namespace

size_t bytesPerValue(StoredType type) {
  switch (type) {
    case StoredType::u8:
    case StoredType::i8:
      return 1;
    case StoredType::u16:
    case StoredType::i16:
    case StoredType::f16:
      return 2;
    case StoredType::u32:
    case StoredType::i32:
    case StoredType::f32:
      return 4;
    case StoredType::f64:
    case StoredType::u64:
    case StoredType::i64:
      break;
  }
  return 8;
}

StoredType storedType(ValueType type) {
  static_assert(int(StoredType::u8) == int(ValueType::u8) && int(StoredType::f64) == int(ValueType::f64));
  return StoredType(int(type));
}

ValueType keptType(StoredType type) {
  if (type == StoredType::f16) return ValueType::f32;
  if (type == StoredType::u64 || type == StoredType::i64) return ValueType::f64;
  return ValueType(int(type));
}

void convertValues(std::span<const std::byte> stored, StoredType from, ByteOrder order, Interleaved interleaved,
                   Scaling scaling, ValueType type, std::span<std::byte> out) {
  check(type == (scaling.isNone() ? keptType(from) : ValueType::f32), "values are kept as their stored type asks for");
  checkEqual(stored.size(), out.size() / bytesPerValue(type) * size_t(interleaved.count) * bytesPerValue(from),
             "bytes of stored values");
  const bool native = isNative(order);
  const auto convert = [&](auto example) {
    convertFrom<decltype(example)>(stored, native, interleaved, scaling, type, out);
  };
  switch (from) {
    case StoredType::u8:
      return convert(uint8_t{});
    case StoredType::i8:
      return convert(int8_t{});
    case StoredType::u16:
      return convert(uint16_t{});
    case StoredType::i16:
      return convert(int16_t{});
    case StoredType::u32:
      return convert(uint32_t{});
    case StoredType::i32:
      return convert(int32_t{});
    case StoredType::f32:
      return convert(float{});
    case StoredType::f64:
      return convert(double{});
    case StoredType::f16:
      return convert(Half{});
    case StoredType::u64:
      return convert(uint64_t{});
    case StoredType::i64:
      return convert(int64_t{});
  }
}

void swapBytes(std::span<std::byte> bytes, size_t valueBytes) {
  if (valueBytes == 2) swapEach<uint16_t>(bytes);
  if (valueBytes == 4) swapEach<uint32_t>(bytes);
  if (valueBytes == 8) swapEach<uint64_t>(bytes);
}

float floatFromHalf(uint16_t half) {
  const int exponent = half >> 10 & 31;
  const int mantissa = half & 1023;
  const float sign = (half & 0x8000) != 0 ? -1.0f : 1.0f;
  if (exponent == 31) return mantissa == 0 ? sign * std::numeric_limits<float>::infinity() : NAN;
  if (exponent == 0) return sign * std::ldexp(float(mantissa), -24);
  return sign * std::ldexp(float(1024 + mantissa), exponent - 25);
}

}  // namespace freevoxel
