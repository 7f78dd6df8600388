// Help and docs cannot drift apart.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

TEST(Documentation, commandsPageIsWhatHelpPrints) {
  const std::string script = sourceFolder() + "/scripts/write_command_docs.sh";
  const ProcessResult page = runProcess({"/bin/bash", script, programPath()});
  ASSERT_EQ(page.status, 0) << page.talk;
  std::istringstream printed(page.output), written(readBytes(sourceFolder() + "/docs/commands.md"));
  std::string printedLine, writtenLine;
  while (std::getline(printed, printedLine)) {
    std::getline(written, writtenLine);
    ASSERT_EQ(printedLine, writtenLine) << "run: scripts/write_command_docs.sh PROGRAM > docs/commands.md";
  }
  EXPECT_FALSE(std::getline(written, writtenLine)) << "nothing prints: " << writtenLine;
}

TEST(Documentation, exampleTransferFunctionsAreRead) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "cloud", "--dims", "5,7,11", "-o", "cloud.nrrd"});
  for (const std::string& name : listFolder(sourceFolder() + "/examples/transfer")) {
    if (!name.ends_with(".json")) continue;
    freevoxelDone(folder, {"precompute", "cloud.nrrd", "--transfer", sourceFolder() + "/examples/transfer/" + name,
                           "-o", "cloud.fvx", "--quiet"});
  }
}

}  // namespace
}  // namespace freevoxel::test
