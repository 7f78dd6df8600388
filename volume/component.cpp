#include "volume/component.h"

#include <algorithm>

#include "base/error.h"
#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

/// All names on one line; of very many the first.
std::string listed(const std::vector<std::string>& names) {
  constexpr size_t kMost = 12;
  std::string text;
  for (size_t i = 0; i < std::min(names.size(), kMost); ++i)
    text += (i > 0 ? ", " : "") + inQuotes(names[i]);
  return names.size() > kMost ? text + ", ..." : text;
}

}  // namespace

std::vector<std::string> numberedComponents(int count) {
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i)
    names.push_back(std::to_string(i));
  return names;
}

size_t chooseComponent(const std::vector<std::string>& names, const std::optional<std::string>& wanted,
                       const std::string& where) {
  check(!names.empty(), "there is a component to choose");
  if (!wanted) {
    if (names.size() == 1) return 0;
    throw InputError(fmt::format("{}: holds {} values per voxel ({}); choose one with --component", where, names.size(),
                                 listed(names)));
  }
  if (const auto named = std::find(names.begin(), names.end(), *wanted); named != names.end()) {
    return size_t(named - names.begin());
  }
  if (const std::optional<size_t> number = parseNumber<size_t>(*wanted); number && *number < names.size()) {
    return *number;
  }
  throw InputError(fmt::format("{}: has no component {}; there {} {}", where, inQuotes(*wanted),
                               names.size() == 1 ? "is only" : "are", listed(names)));
}

}  // namespace freevoxel
