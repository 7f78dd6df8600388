// A user who presses Ctrl-C finds no half-written files.
#include <gtest/gtest.h>
#include <signal.h>

#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

class Interruption : public ::testing::TestWithParam<int> {};

TEST_P(Interruption, leavesNothingBehind) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "sphere", "--dims", "64,48,40", "-o", "a.nrrd"});
  writeBytes(folder + "/t.json",
             R"({"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0.5}]})");
  ProcessOptions options;
  options.folder = folder;
  options.signal = GetParam();
  options.signalAfter = 0.4;
  // Far more work than 0.4 seconds.
  const ProcessResult result = runProcess({programPath(), "render", "a.nrrd", "--transfer", "t.json", "-o", "a.exr",
                                           "--size", "4000x3000", "--threads", "1", "--quiet"},
                                          options);
  EXPECT_EQ(result.status, 128 + GetParam()) << result.talk;
  EXPECT_EQ(listFolder(folder), (std::vector<std::string>{"a.nrrd", "t.json"}));
}

INSTANTIATE_TEST_SUITE_P(Signals, Interruption, ::testing::Values(SIGINT, SIGTERM));

}  // namespace
}  // namespace freevoxel::test
