#include "app/help.h"

#include <fmt/core.h>

#include <sstream>
#include <utility>
#include <vector>

namespace freevoxel {

namespace {

constexpr size_t kTextColumn = 32;
constexpr size_t kLineEnd = 110;

/// Lines no longer than `width`, where words allow it; newlines in `text` stay.
std::vector<std::string> wrapped(const std::string& text, size_t width) {
  std::vector<std::string> lines;
  std::istringstream paragraphs(text);
  for (std::string paragraph; std::getline(paragraphs, paragraph);) {
    lines.emplace_back();
    std::istringstream words(paragraph);
    for (std::string word; words >> word;) {
      if (!lines.back().empty() && lines.back().size() + 1 + word.size() > width) lines.emplace_back();
      lines.back() += (lines.back().empty() ? "" : " ") + word;
    }
  }
  return lines;
}

std::string twoColumns(const std::string& name, const std::string& text) {
  std::string out;
  std::string left = "  " + name;
  for (const std::string& line : wrapped(text, kLineEnd - kTextColumn)) {
    if (left.size() >= kTextColumn) {
      out += left + '\n';
      left.clear();
    }
    out += fmt::format("{:<{}}{}\n", left, kTextColumn, line);
    left.clear();
  }
  return out;
}

}  // namespace

std::string HelpFormatter::make_option(const CLI::Option* option, bool positional) const {
  std::string name = option->get_name(positional, true);
  for (size_t comma = name.find(','); comma != std::string::npos; comma = name.find(',', comma + 2)) {
    name.insert(comma + 1, " ");
  }
  if (!positional && option->get_type_size() != 0) name += ' ' + option->get_type_name();
  return twoColumns(name, option->get_description() + (option->get_required() && !positional ? " (required)" : ""));
}

std::string HelpFormatter::make_help(const CLI::App* command, std::string name, CLI::AppFormatMode mode) const {
  // One empty line between groups of options is enough.
  return CLI::detail::find_and_replace(CLI::Formatter::make_help(command, std::move(name), mode), "\n\n\n", "\n\n");
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return twoColumns(command->get_name(), command->get_description());
}

}  // namespace freevoxel
