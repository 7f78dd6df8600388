#include "hierarchy/file_reading.h"

#include <algorithm>
#include <numeric>

namespace freevoxel {

void checkFrameList(const std::string& path, const SectionEntry& section, size_t count, uint64_t directory,
                    size_t entryBytes, const std::function<std::pair<uint64_t, uint32_t>(size_t)>& frame,
                    size_t offsetField, size_t bytesField) {
  if (section.items != count) {
    throw mismatch(path, section.offset, fmt::format("items of {}", text(section.type)), count, section.items);
  }
  const auto at = [&](size_t i, size_t field) { return directory + i * entryBytes + field; };
  std::vector<size_t> byOffset(count);
  std::iota(byOffset.begin(), byOffset.end(), size_t(0));
  std::sort(byOffset.begin(), byOffset.end(), [&](size_t a, size_t b) { return frame(a) < frame(b); });
  uint64_t end = 0;
  for (const size_t i : byOffset) {
    const auto [offset, bytes] = frame(i);
    if (offset != end) {
      throw mismatch(path, at(i, offsetField), fmt::format("offset of brick {} in {}", i, text(section.type)), end,
                     offset);
    }
    if (bytes > section.bytes - end) {
      throw mismatch(path, at(i, bytesField), fmt::format("bytes of brick {} in {}", i, text(section.type)),
                     fmt::format("at most {}", section.bytes - end), bytes);
    }
    end += bytes;
  }
  if (end != section.bytes) {
    throw mismatch(path, section.offset, fmt::format("bytes of the frames of {}", text(section.type)), section.bytes,
                   end);
  }
}

}  // namespace freevoxel
