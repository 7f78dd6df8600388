// File names with a number in them: "slice%03d.png" and the files of a folder that differ in one number.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace freevoxel {

/// Name number `index` of a printf pattern with one %d, %4d or %04d (i and u will do too, and %% is a percent sign);
/// nothing if it is no such pattern.
std::optional<std::string> expandPattern(std::string_view pattern, int index);

/// Whether a name is such a pattern.
bool isPattern(std::string_view name);

/// The numbers, ascending, for which a pattern names a file that exists.
std::vector<int> numbersOfPattern(const std::string& pattern);

/// Names in the order of people: digits compare as numbers, all else as characters ("s2" before "s10").
bool naturallyBefore(std::string_view a, std::string_view b);

}  // namespace freevoxel
