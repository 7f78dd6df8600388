#include "app/command.h"

namespace freevoxel {

CLI::App* addSubcommand(CLI::App& program, const std::string& name, const std::string& description,
                        const std::string& example) {
  CLI::App* command = program.add_subcommand(name, description);
  command->footer("Example:\n  " + example);
  return command;
}

}  // namespace freevoxel
