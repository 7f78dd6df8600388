// How files keep values where that is not how we keep them, and the way from the one to the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "volume/volume.h"

namespace freevoxel {

enum class ByteOrder { little, big };

/// Number type of a value in a file: those of ValueType, and three that are turned into one of them.
enum class StoredType { u8, i8, u16, i16, u32, i32, f32, f64, f16, u64, i64 };

size_t bytesPerValue(StoredType type);
StoredType storedType(ValueType type);
/// What is kept of a stored type: itself; f32 of f16; f64 of 64-bit integers (exact up to 2^53).
ValueType keptType(StoredType type);

/// value = slope * stored + intercept, kept as f32; nothing happens if slope is 1 and intercept 0.
struct Scaling {
  double slope = 1.0;
  double intercept = 0.0;
  bool isNone() const { return slope == 1.0 && intercept == 0.0; }
};

/// One of several values that lie side by side for every voxel.
struct Interleaved {
  int count = 1;
  int chosen = 0;
};

/// Turns the bytes of a file's values, `interleaved.count` per voxel, into values of `type` in this machine's byte
/// order. `type` is keptType(from), or f32 where there is a scaling. Sizes: stored = out.size() / bytesPerValue(type)
/// * interleaved.count * bytesPerValue(from).
void convertValues(std::span<const std::byte> stored, StoredType from, ByteOrder order, Interleaved interleaved,
                   Scaling scaling, ValueType type, std::span<std::byte> out);

/// Reverses the bytes of each value.
void swapBytes(std::span<std::byte> bytes, size_t valueBytes);

/// The number that 16 bits stand for in IEEE 754's half precision.
float floatFromHalf(uint16_t half);

}  // namespace freevoxel
