#include "volume/volume.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace freevoxel {

namespace {

// Chunks are summed on their own and added in order, so the figures do not depend on the number of threads.
constexpr uint64_t kChunk = uint64_t(1) << 18;

template <class T>
ValueStatistics chunkStatistics(const T* values, uint64_t count) {
  // 64 bits hold a chunk's sum of any integer type; adding them to a double is exact up to 2^53.
  using Sum = std::conditional_t<std::is_floating_point_v<T>, double, int64_t>;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ValueStatistics statistics{.low = kInfinity, .high = -kInfinity};
  Sum sum = 0;
  for (uint64_t i = 0; i < count; ++i) {
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(values[i])) {
        ++statistics.nonFinite;
        continue;
      }
    }
    sum += Sum(values[i]);
    statistics.low = std::min(statistics.low, double(values[i]));
    statistics.high = std::max(statistics.high, double(values[i]));
  }
  statistics.sum = double(sum);
  return statistics;
}

template <class T>
ValueStatistics statisticsOf(const T* values, uint64_t count) {
  const auto chunks = int64_t((count + kChunk - 1) / kChunk);
  std::vector<ValueStatistics> parts(size_t(chunks), ValueStatistics{});
#pragma omp parallel for schedule(static)
  for (int64_t chunk = 0; chunk < chunks; ++chunk) {
    const uint64_t first = uint64_t(chunk) * kChunk;
    parts[size_t(chunk)] = chunkStatistics(values + first, std::min(kChunk, count - first));
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ValueStatistics all{.low = kInfinity, .high = -kInfinity};
  for (const ValueStatistics& part : parts) {
    all.low = std::min(all.low, part.low);
    all.high = std::max(all.high, part.high);
    all.sum += part.sum;
    all.nonFinite += part.nonFinite;
  }
  if (all.low > all.high) all.low = all.high = 0.0;
  return all;
}

}  // namespace

size_t bytesPerValue(ValueType type) {
  switch (type) {
    case ValueType::u8:
    case ValueType::i8:
      return 1;
    case ValueType::u16:
    case ValueType::i16:
      return 2;
    case ValueType::u32:
    case ValueType::i32:
    case ValueType::f32:
      return 4;
    case ValueType::f64:
      break;
  }
  return 8;
}

std::string_view valueTypeName(ValueType type) {
  switch (type) {
    case ValueType::u8:
      return "u8";
    case ValueType::i8:
      return "i8";
    case ValueType::u16:
      return "u16";
    case ValueType::i16:
      return "i16";
    case ValueType::u32:
      return "u32";
    case ValueType::i32:
      return "i32";
    case ValueType::f32:
      return "f32";
    case ValueType::f64:
      break;
  }
  return "f64";
}

bool isFloatingPoint(ValueType type) {
  return type == ValueType::f32 || type == ValueType::f64;
}

double Volume::value(uint64_t linear) const {
  return withValues(*this, [linear](const auto* values) { return double(values[linear]); });
}

ValueStatistics valueStatistics(const Volume& volume) {
  return withValues(volume, [&](const auto* values) { return statisticsOf(values, volume.header.voxels()); });
}

}  // namespace freevoxel
