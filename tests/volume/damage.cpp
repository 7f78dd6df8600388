#include "tests/volume/damage.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <random>

namespace freevoxel::test {

std::vector<size_t> lengthsOf(size_t size) {
  const size_t step = size / kMostLengths + 1;
  std::vector<size_t> lengths;
  for (size_t length = 0; length <= size; length += length + 40 < size ? step : 1)
    lengths.push_back(length);
  return lengths;
}

std::string changed(const std::string& whole, size_t seed) {
  std::minstd_rand random(unsigned(seed) * 2654435761u + 1);
  std::string bytes = whole;
  const size_t reach = seed % 3 == 0 ? std::min<size_t>(whole.size(), 600) : whole.size();
  for (size_t i = 0, count = 1 + random() % 4; i < count; ++i) {
    constexpr uint8_t kTelling[] = {0, 1, 0x7f, 0x80, 0xff, '9', '-', ' '};
    char& byte = bytes[random() % reach];
    switch (random() % 3) {
      case 0:
        byte = char(uint8_t(byte) ^ 1u << random() % 8);
        break;
      case 1:
        byte = char(kTelling[random() % std::size(kTelling)]);
        break;
      default:
        byte = char(random() % 256);
    }
  }
  return bytes;
}

}  // namespace freevoxel::test
