#include "volume/value_codes.h"

#include <cmath>

#include "base/error.h"

namespace freevoxel {

namespace {

constexpr uint32_t kLargestCode = 65535;

}  // namespace

uint32_t ValueCoding::encode(double value) const {
  const double code = position(value);
  if (!(code > 0.0)) return 0;  // NaN too
  if (code >= double(largest)) return largest;
  return uint32_t(code + 0.5);
}

ValueCoding valueCoding(ValueType type, double low, double high) {
  check(std::isfinite(low) && std::isfinite(high) && low < high,
        "the range of a value coding is finite and low < high");
  if (!isFloatingPoint(type)) {
    const double first = std::floor(low);
    const double last = std::ceil(high);
    if (last - first <= double(kLargestCode)) return {first, 1.0, uint32_t(last - first)};
  }
  // Divided before subtracting: the difference of two finite numbers may be infinite.
  const double step = high / kLargestCode - low / kLargestCode;
  check(step > 0.0, "the range of a value coding is wide enough for its step");
  return {low, step, kLargestCode};
}

std::vector<uint16_t> encodeValues(const Volume& volume, const ValueCoding& coding) {
  const auto count = int64_t(volume.header.voxels());
  std::vector<uint16_t> codes(size_t(count), uint16_t(0));
  withValues(volume, [&](const auto* values) {
#pragma omp parallel for schedule(static)
    for (int64_t i = 0; i < count; ++i)
      codes[size_t(i)] = uint16_t(coding.encode(double(values[i])));
  });
  return codes;
}

}  // namespace freevoxel
