// The commands of the program, one file each.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "app/options.h"
#include "app/session.h"

namespace freevoxel {

/// What ends a run in the ordinary way.
enum class Outcome { done, failed };

/// A command as the parser knows it and what it does. Errors leave `run` as exceptions.
struct Command {
  CLI::App* parser;
  std::function<Outcome(Session&)> run;
  bool shared = false;  ///< several ranks share its work; otherwise rank 0 does it alone
};

/// A subcommand with its one line of description and an example, common options to be added last.
CLI::App* addSubcommand(CLI::App& program, const std::string& name, const std::string& description,
                        const std::string& example);

Command addGenerate(CLI::App& program, CommonOptions& common);
Command addPrecompute(CLI::App& program, CommonOptions& common);
Command addInfo(CLI::App& program, CommonOptions& common);
Command addVerify(CLI::App& program, CommonOptions& common);
Command addRender(CLI::App& program, CommonOptions& common);
Command addCompare(CLI::App& program, CommonOptions& common);
Command addTransfer(CLI::App& program, CommonOptions& common);
Command addTrace(CLI::App& program, CommonOptions& common);
Command addSheet(CLI::App& program, CommonOptions& common);
Command addSpeedup(CLI::App& program, CommonOptions& common);

}  // namespace freevoxel
