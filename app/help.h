// How --help looks.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace freevoxel {

/// Option, placeholder and text in two columns, the text wrapped. Descriptions state unit, range and default.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool positional) const override;
  std::string make_help(const CLI::App* command, std::string name, CLI::AppFormatMode mode) const override;
  std::string make_subcommand(const CLI::App* command) const override;
};

}  // namespace freevoxel
