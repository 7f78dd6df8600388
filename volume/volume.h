// A grid of scalar values in memory, as read from a file or generated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <string_view>
#include <vector>

#include "base/grid.h"
#include "base/placement.h"

namespace freevoxel {

/// Number type of a voxel's value. Names are those of the command line.
enum class ValueType { u8, i8, u16, i16, u32, i32, f32, f64 };

size_t bytesPerValue(ValueType type);
std::string_view valueTypeName(ValueType type);
bool isFloatingPoint(ValueType type);

/// What is known of a volume before its values are read.
/// Invariant: validDims(dims), placement valid.
struct VolumeHeader {
  glm::ivec3 dims{0};
  ValueType type = ValueType::u8;
  Placement placement;
  bool labels = false;  ///< values are names, not amounts: nothing may be interpolated between two of them

  uint64_t voxels() const { return voxelCount(dims); }
  uint64_t bytes() const { return voxels() * bytesPerValue(type); }
};

/// A volume in memory. `data` holds header.bytes() bytes, x fastest, then y, then z, in this machine's byte order,
/// exactly as stored: NaN and infinities included.
struct Volume {
  VolumeHeader header;
  std::vector<std::byte> data;

  /// Value of the voxel at `linear` (see linearIndex) as a double; NaN and infinities as they are.
  double value(uint64_t linear) const;
};

/// Calls f with a `const T*` of the volume's own type T pointing to its values.
template <class F>
decltype(auto) withValues(const Volume& volume, F&& f) {
  const void* data = volume.data.data();
  switch (volume.header.type) {
    case ValueType::u8:
      return f(static_cast<const uint8_t*>(data));
    case ValueType::i8:
      return f(static_cast<const int8_t*>(data));
    case ValueType::u16:
      return f(static_cast<const uint16_t*>(data));
    case ValueType::i16:
      return f(static_cast<const int16_t*>(data));
    case ValueType::u32:
      return f(static_cast<const uint32_t*>(data));
    case ValueType::i32:
      return f(static_cast<const int32_t*>(data));
    case ValueType::f32:
      return f(static_cast<const float*>(data));
    case ValueType::f64:
      break;
  }
  return f(static_cast<const double*>(data));
}

/// Figures of a volume's values. `low`, `high` and `sum` are over finite values only (0 if there are none).
struct ValueStatistics {
  double low = 0.0;
  double high = 0.0;
  double sum = 0.0;        ///< exact for integer types up to 2^53
  uint64_t nonFinite = 0;  ///< NaN and infinities
};
ValueStatistics valueStatistics(const Volume& volume);

}  // namespace freevoxel
