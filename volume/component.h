// Which of several values per voxel is meant.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace freevoxel {

/// "0", "1", ...: what components are called that have no names.
std::vector<std::string> numberedComponents(int count);

/// Index among `names` of what `wanted` says: a name, or a number from 0. Unset: the only one. Throws InputError with
/// `where` (the file) and all names.
size_t chooseComponent(const std::vector<std::string>& names, const std::optional<std::string>& wanted,
                       const std::string& where);

}  // namespace freevoxel
