// The bar on a terminal, and nothing elsewhere.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <regex>

#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

constexpr const char* kTerminal = "/usr/bin/script";

TEST(ProgressBar, showsRateAndTimeLeftOnATerminalOnly) {
  if (access(kTerminal, X_OK) != 0) GTEST_SKIP() << "no " << kTerminal << " to make a terminal with";
  const std::string folder = temporaryFolder();
  constexpr double kSteps = 160.0 * 150.0 * 140.0 * 26.0;
  freevoxelDone(folder, words("generate cloud --dims 160,150,140 -o a.nrrd"));
  writeBytes(folder + "/t.json", R"({"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0},
                                                                  {"value": 255, "color": [1, 1, 1], "opacity": 1}]})");
  const std::string call = "precompute a.nrrd --transfer t.json -o a.fvx --threads 1";
  EXPECT_EQ(freevoxelDone(folder, words(call)).talk, "");

  ProcessOptions options;
  options.folder = folder;
  options.environment = {{"TERM", "xterm"}};
  const ProcessResult result =
      runProcess({kTerminal, "-q", "-e", "-c", "'" + programPath() + "' " + call, "/dev/null"}, options);
  EXPECT_EQ(result.status, 0) << result.output << result.talk;
  const std::string erased = "\r\x1b[K";
  EXPECT_TRUE(result.output.ends_with(erased)) << "the bar is gone at the end";

  const std::regex line(R"(attenuation \[(#*) *\] +([0-9]+) %  ([0-9.]+) ([kMG]?)voxels/s  ([0-9]+):([0-9]{2}) left)");
  int lines = 0, before = 0;
  for (auto found = std::sregex_iterator(result.output.begin(), result.output.end(), line);
       found != std::sregex_iterator(); ++found, ++lines) {
    const std::smatch& match = *found;
    const int percent = std::stoi(match[2]);
    EXPECT_GE(percent, before);
    EXPECT_LE(percent, 100);
    before = percent;
    EXPECT_NEAR(double(match[1].length()), 24.0 * percent / 100.0, 1.2) << match.str();
    const std::string prefix = match[4];
    const double rate = std::stod(match[3]) * (prefix == "k" ? 1e3 : prefix == "M" ? 1e6 : prefix == "G" ? 1e9 : 1.0);
    const double expected = (1.0 - percent / 100.0) * kSteps / rate,
                 shown = 60.0 * std::stoi(match[5]) + std::stoi(match[6]);
    // Half a second by rounding, half a percent of all by the share's rounding.
    EXPECT_NEAR(shown, expected, 0.51 + 0.0051 * kSteps / rate + 0.01 * expected) << match.str();
  }
  EXPECT_GE(lines, 1) << result.output;
}

}  // namespace
}  // namespace freevoxel::test
