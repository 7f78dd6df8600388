#include "splat/cover_values.h"

#include "shaders/shared/exact_math.h"

namespace freevoxel {

void coverOf(int level, std::span<const TableEntry> matter, std::vector<shared::CoverValue>& cover) {
  const float length = shared::kCoverVoxels * float(1 << level);
  cover.resize(matter.size());
  for (size_t i = 0; i < matter.size(); ++i) {
    const TableEntry& from = matter[i];
    if (!(from.extinction > 0.0f)) {
      cover[i] = {0.0f, 0.0f, 0.0f, 0.0f};
      continue;
    }
    const float depth = from.extinction * length;
    const float opacity = shared::absorbed(depth);
    const float perExtinction = opacity / from.extinction;
    cover[i] = {from.red * perExtinction, from.green * perExtinction, from.blue * perExtinction,
                opacity > 0.5f ? -shared::transmitted(depth) : opacity};
  }
}

}  // namespace freevoxel
