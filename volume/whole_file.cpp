#include "volume/whole_file.h"

#include <algorithm>
#include <array>

#include "base/error.h"
#include "volume/byte_source.h"

namespace freevoxel {

std::vector<std::byte> readWholeFile(const std::string& path, size_t atMost) {
  std::array<std::byte, 3> first{};
  const bool compressed = openPlain(path, 0)->read(first) == first.size() && isGzip(first);
  const auto source = compressed ? openInflated(path, 0) : openPlain(path, 0);
  std::vector<std::byte> bytes;
  constexpr size_t kPortion = size_t(1) << 20;
  for (;;) {
    const size_t before = bytes.size();
    bytes.resize(before + kPortion);
    const size_t got = source->read(std::span(bytes).subspan(before));
    bytes.resize(before + got);
    if (bytes.size() > atMost) {
      throw InputError(fmt::format("{}: expected at most {} bytes{}, found more", path, atMost,
                                   compressed ? " after inflating" : ""));
    }
    if (got < kPortion) return bytes;
  }
}

}  // namespace freevoxel
