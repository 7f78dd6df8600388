// Vectors that give their memory back.
#pragma once

#include <vector>

namespace freevoxel {

/// Empties `values` and frees its memory, which `values = {}` does not: that assigns an empty list, in the old room.
template <class T>
void giveBack(std::vector<T>& values) {
  std::vector<T>().swap(values);
}

}  // namespace freevoxel
