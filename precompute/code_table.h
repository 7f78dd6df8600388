// A number for every value code, looked up for whole rows; or the code itself.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace freevoxel {

/// Rows of codes one after another.
struct CodeRows {
  const uint16_t* codes = nullptr;
  size_t width = 0, count = 0;
  ptrdiff_t ahead = 0;  ///< from here to codes that will be wanted next, and may be fetched into the caches
};

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

  /// out[stride * row + x] = entries[code x of the row], for codes below the number of entries.
  template <class T>
  void lookUp(const CodeRows& rows, T* out, size_t stride) const {
    lookUpBits(rows, reinterpret_cast<uint32_t*>(out), stride);
  }

 private:
  static constexpr size_t kByteCodes = 256;
  void split();
  void lookUpBits(const CodeRows& rows, uint32_t* out, size_t stride) const;

  std::vector<uint32_t> bits_;
  /// If no code takes more than a byte: byte b of the entry of code c at 256 b + c.
  std::vector<uint8_t> bytes_;
};

/// out[stride * row + x] = code x of the row.
void codesAsFloats(const CodeRows& rows, float* out, size_t stride);

}  // namespace freevoxel
