#include "volume/text_parsing.h"

namespace freevoxel {

namespace {

constexpr std::string_view kWhiteSpace = " \t\r\n\v\f";

}  // namespace

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kWhiteSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kWhiteSpace) - first + 1);
}

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> found;
  for (size_t first = text.find_first_not_of(kWhiteSpace); first != std::string_view::npos;) {
    const size_t last = text.find_first_of(kWhiteSpace, first);
    found.push_back(text.substr(first, last - first));
    first = text.find_first_not_of(kWhiteSpace, last);
  }
  return found;
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  }
  return lower;
}

std::string inQuotes(std::string_view text) {
  constexpr size_t kLongest = 40;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest))
    result += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > kLongest) result += "...";
  return result + "'";
}

}  // namespace freevoxel
