#include "volume/imagevis3d_table.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "base/error.h"
#include "volume/text_parsing.h"

namespace freevoxel {

TransferFunction parseImageVis3dTable(const std::string& text, const std::string& name) {
  TransferFunction transfer;
  size_t expected = 0;
  int line = 0;
  for (size_t next = 0; next < text.size();) {
    const size_t end = std::min(text.find('\n', next), text.size());
    const std::string_view content = trimmed(std::string_view(text).substr(next, end - next));
    next = end + 1;
    ++line;
    if (content.empty()) continue;
    const auto fail = [&](const std::string& what) {
      throw InputError(fmt::format("{}: line {}: expected {}, found {}", name, line, what, inQuotes(content)));
    };
    if (expected == 0) {
      constexpr size_t kMost = 65536;
      expected = parseNumber<size_t>(content).value_or(0);
      if (expected < 2 || expected > kMost) fail(fmt::format("a number of entries in 2..{}", kMost));
      continue;
    }
    const std::vector<std::string_view> parts = words(content);
    std::array<double, 4> entry{};
    bool good = parts.size() == 4 && transfer.points.size() < expected;
    for (size_t i = 0; good && i < 4; ++i) {
      entry[i] = parseNumber<double>(parts[i]).value_or(-1.0);
      good = entry[i] >= 0.0 && entry[i] <= 1.0;
    }
    if (!good) fail("red, green, blue and opacity, each 0..1");
    transfer.points.push_back({double(transfer.points.size()), {entry[0], entry[1], entry[2]}, entry[3]});
  }
  if (expected == 0 || transfer.points.size() != expected) {
    throw InputError(fmt::format("{}: expected {} entries, found {}", name, expected, transfer.points.size()));
  }
  transfer.low = 0.0;
  transfer.high = double(expected - 1);
  return transfer;
}

}  // namespace freevoxel
