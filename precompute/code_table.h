// A number for every value code, looked up row by row; or the code itself.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

namespace freevoxel {

/// `entries` for codes 0..size-1; T is a whole or floating-point number of 32 bits.
class CodeTable {
 public:
  CodeTable() = default;
  template <class T>
  explicit CodeTable(const std::vector<T>& entries) {
    static_assert(std::is_arithmetic_v<T> && sizeof(T) == sizeof(uint32_t));
    for (const T entry : entries)
      bits_.push_back(std::bit_cast<uint32_t>(entry));
    split();
  }

  /// out[i] = entries[codes[i]], for codes below the number of entries.
  template <class T>
  void row(std::span<const uint16_t> codes, T* out) const {
    lookUp(codes, reinterpret_cast<uint32_t*>(out));
  }

 private:
  static constexpr size_t kByteCodes = 256;
  void split();
  void lookUp(std::span<const uint16_t> codes, uint32_t* out) const;

  std::vector<uint32_t> bits_;
  /// If no code takes more than a byte: byte b of the entry of code c at 256 b + c.
  std::vector<uint8_t> bytes_;
};

/// out[i] = codes[i].
void codesAsFloats(std::span<const uint16_t> codes, float* out);

}  // namespace freevoxel
