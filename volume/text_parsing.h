// Words and numbers in the text of file headers, the same in every locale.
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace freevoxel {

/// Without white space at both ends.
std::string_view trimmed(std::string_view text);
/// What stands between white space.
std::vector<std::string_view> words(std::string_view text);
std::string lowerCase(std::string_view text);
/// For error messages: in quotes, on one line, at most 40 characters, printable ASCII only.
std::string inQuotes(std::string_view text);

/// The number that the whole of `text` is, or nothing.
template <class T>
std::optional<T> parseNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  T number{};
  const std::from_chars_result result = std::from_chars(text.data(), text.data() + text.size(), number);
  if (result.ec != std::errc{} || result.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace freevoxel
