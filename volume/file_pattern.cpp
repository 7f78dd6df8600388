#include "volume/file_pattern.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

constexpr std::string_view kDigits = "0123456789";

bool isDigit(char c) {
  return c >= '0' && c <= '9';
}

/// Digits at the start of `text` without leading zeros; takes them all from `text`.
std::string_view takeNumber(std::string_view& text) {
  const std::string_view digits = text.substr(0, text.find_first_not_of(kDigits));
  text.remove_prefix(digits.size());
  return digits.substr(std::min(digits.find_first_not_of('0'), digits.size()));
}

}  // namespace

std::optional<std::string> expandPattern(std::string_view pattern, int index) {
  std::string name;
  bool numbered = false;
  for (size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] != '%') {
      name += pattern[i];
    } else if (pattern.substr(i, 2) == "%%") {
      name += '%';
      ++i;
    } else {
      const size_t end = pattern.find_first_not_of(kDigits, i + 1);
      if (numbered || end == std::string_view::npos ||
          (pattern[end] != 'd' && pattern[end] != 'i' && pattern[end] != 'u')) {
        return std::nullopt;
      }
      const std::string_view widthText = pattern.substr(i + 1, end - i - 1);
      const int width = widthText.empty() ? 0 : parseNumber<int>(widthText).value_or(1000);
      if (width > 100) return std::nullopt;
      name += widthText.starts_with('0') ? fmt::format("{:0{}}", index, width) : fmt::format("{:{}}", index, width);
      numbered = true;
      i = end;
    }
  }
  return numbered ? std::optional(name) : std::nullopt;
}

bool isPattern(std::string_view name) {
  return expandPattern(name, 0).has_value();
}

std::vector<int> numbersOfPattern(const std::string& pattern) {
  namespace fs = std::filesystem;
  const fs::path path(pattern);
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::vector<int> numbers;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    // Every run of digits in the name may be the pattern's number.
    for (size_t i = 0; i < name.size(); ++i) {
      if (!isDigit(name[i]) || (i > 0 && isDigit(name[i - 1]))) continue;
      const size_t last = std::min(name.find_first_not_of(kDigits, i), name.size());
      const std::optional<int> number = parseNumber<int>(std::string_view(name).substr(i, last - i));
      if (number && expandPattern(path.filename().string(), *number) == name) {
        numbers.push_back(*number);
        break;
      }
    }
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

bool naturallyBefore(std::string_view a, std::string_view b) {
  const std::string_view wholeA = a, wholeB = b;
  while (!a.empty() && !b.empty()) {
    if (isDigit(a[0]) && isDigit(b[0])) {
      const std::string_view x = takeNumber(a), y = takeNumber(b);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  if (a.size() != b.size()) return a.size() < b.size();
  return wholeA < wholeB;
}

}  // namespace freevoxel
