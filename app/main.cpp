// The freevoxel program: parses the command line, runs one command, tells the user of errors.
#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "app/command.h"
#include "app/help.h"
#include "app/session.h"
#include "app/signals.h"
#include "base/error.h"
#include "parallel/ranks.h"
#include "volume/child_reader.h"
#include "voxlink/read_mesh.h"

namespace freevoxel {

namespace {

enum ExitStatus { kDone = 0, kFailed = 1, kUsage = 2 };

/// Errors are one line, whatever a library put into its message.
void tellError(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  fmt::print(stderr, "freevoxel: {}\n", text);
}

/// What the exception that is being handled says of the run.
Failure currentFailure(int rank, const std::string& commandName) {
  try {
    throw;
  } catch (const UsageError& error) {
    return {rank, kUsage, fmt::format("{} (see freevoxel {} --help)", error.what(), commandName)};
  } catch (const std::bad_alloc&) {
    return {rank, kFailed, "out of memory: try a smaller volume or a smaller --size, or close other programs"};
  } catch (const std::exception& error) {
    return {rank, kFailed, error.what()};
  }
}

/// Runs the command on all ranks and gives the exit status that they have in common. If it fails on any of them, rank 0
/// says where and why.
int runTogether(const Command& command, const std::string& typed, const CommonOptions& common, const Ranks& ranks) {
  std::optional<Failure> failure;
  try {
    if (command.shared || ranks.isRoot()) {
      Session session(typed, common, ranks, command.shared);
      if (command.run(session) == Outcome::failed) failure = {ranks.rank(), kFailed, ""};
      session.writeStatistics();
    }
    failure = ranks.agree(failure);
  } catch (const RankFailed& other) {
    failure = other.failure;
  } catch (...) {
    failure = currentFailure(ranks.rank(), command.parser->get_name());
    if (ranks.outOfStep()) {
      tellError(fmt::format("rank {}: {}", ranks.rank(), failure->text));
      MPI_Abort(ranks.communicator(), failure->status);
    }
    failure = ranks.agree(failure);
  }
  if (!failure) return kDone;
  if (ranks.isRoot() && !failure->text.empty()) {
    const bool sayWhere = command.shared && ranks.rankCount() > 1 && failure->status != kUsage;
    tellError((sayWhere ? fmt::format("rank {}: ", failure->rank) : "") + failure->text);
  }
  return failure->status;
}

/// The command chosen, or null if parsing has said all there is to say; then `status` is set. Every rank comes to the
/// same, and rank 0 says it.
const Command* parse(CLI::App& program, const std::vector<Command>& commands, int argc, char** argv, const Ranks& ranks,
                     int& status) {
  std::string name;
  const auto refuse = [&](const std::string& text) {
    for (const Command& command : commands) {
      if (command.parser->parsed()) name = command.parser->get_name() + ' ';
    }
    if (ranks.isRoot()) tellError(fmt::format("{} (see freevoxel {}--help)", text, name));
    status = kUsage;
    return nullptr;
  };
  try {
    program.parse(argc, argv);
  } catch (const CLI::Success& request) {  // --help, --version
    std::ostringstream nowhere;
    status = ranks.isRoot() ? program.exit(request) : program.exit(request, nowhere, nowhere);
    return nullptr;
  } catch (const CLI::ParseError& error) {
    return refuse(error.what());
  } catch (const UsageError& error) {
    return refuse(error.what());
  }
  const auto chosen =
      std::find_if(commands.begin(), commands.end(), [](const Command& c) { return c.parser->parsed(); });
  if (chosen == commands.end()) return refuse("give a command");
  return &*chosen;
}

int run(int argc, char** argv, const Ranks& ranks) {
  CLI::App program("Order-independent volume renderer: every voxel knows how much light survives on its way out.",
                   "freevoxel");
  program.formatter(std::make_shared<HelpFormatter>());
  program.set_help_flag("-h,--help", "print this help and exit");
  program.set_version_flag("--version", programVersion(), "print the version and exit");
  program.require_subcommand(0, 1);
  program.footer(
      "freevoxel COMMAND --help is complete. Exit status: 0 done, 1 the input or the machine would not do, "
      "2 usage.");
  CommonOptions common;
  const std::vector<Command> commands = {addGenerate(program, common), addPrecompute(program, common),
                                         addInfo(program, common),     addVerify(program, common),
                                         addRender(program, common),   addCompare(program, common),
                                         addTransfer(program, common), addSheet(program, common),
                                         addTrace(program, common),    addSpeedup(program, common)};
  int status = kDone;
  const Command* command = parse(program, commands, argc, argv, ranks, status);
  return command == nullptr ? status : runTogether(*command, typedCommand(argc, argv), common, ranks);
}

}  // namespace

}  // namespace freevoxel

int main(int argc, char** argv) {
  using namespace freevoxel;
  // Files that foreign libraries read are read in a child process, which is this program again.
  if (argc == 2 && std::string_view(argv[1]) == kReaderArgument) runLibraryReader();
  if (argc == 2 && std::string_view(argv[1]) == kMeshReaderArgument) runMeshReader();
  cleanUpOnSignals();
  const Ranks ranks(argc, argv);
  int status = kFailed;
  try {
    status = run(argc, argv, ranks);
  } catch (...) {
    tellError(currentFailure(ranks.rank(), "COMMAND").text);
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    tellError("cannot write to standard output");
    status = kFailed;
  }
  return status;
}
