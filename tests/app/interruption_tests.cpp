// A user who presses Ctrl-C finds no half-written files; one whose machine fails him finds none that look whole.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <random>
#include <thread>

#include "base/address_sanitizer.h"
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

const char* const kHalf = R"({"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0.0},
                             {"value": 255, "color": [1, 1, 1], "opacity": 0.5}]})";

bool isTemporary(const std::string& name) {
  return name.find(".partial-") != std::string::npos;
}

std::vector<std::string> temporaries(const std::string& folder) {
  std::vector<std::string> names = listFolder(folder);
  names.erase(std::remove_if(names.begin(), names.end(), [](const auto& name) { return !isTemporary(name); }),
              names.end());
  return names;
}

class Killed : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Layouts, Killed, ::testing::Values("dense", "compact"));

TEST_P(Killed, leavesNoFileThatLooksWhole) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "cloud", "--dims", "180,150,120", "-o", "a.nrrd"});
  writeBytes(folder + "/t.json", kHalf);
  const std::vector<std::string> call = {"precompute", "a.nrrd", "--transfer", "t.json",    "--layout", GetParam(),
                                         "-o",         "a.fvx",  "--quiet",    "--threads", "1"};
  std::vector<std::string> program = {programPath()};
  program.insert(program.end(), call.begin(), call.end());
  const auto start = std::chrono::steady_clock::now();
  freevoxelDone(folder, call);
  const double whole = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::filesystem::remove(folder + "/a.fvx");

  // A process that is killed tells the sanitizers nothing.
  constexpr int kKilled = kUnderAddressSanitizer ? 2 : 10, kWhileWriting = kKilled / 2;
  std::mt19937 random(51);
  int killed = 0, whileWriting = 0;
  for (int attempt = 0; attempt < 150 && (killed < kKilled || whileWriting < kWhileWriting); ++attempt) {
    ProcessOptions options;
    options.folder = folder;
    options.signal = SIGKILL;
    // Every other one late, where the writing is: on a busy machine `whole` says little.
    options.signalAfter = whole * std::uniform_real_distribution<double>(attempt % 2 == 0 ? 0.05 : 0.5, 1.0)(random);
    const bool whileRunning = runProcess(program, options).status == 128 + SIGKILL;
    // Killed too late, on its way out: what is there is whole.
    if (!whileRunning || std::filesystem::exists(folder + "/a.fvx")) {
      EXPECT_TRUE(temporaries(folder).empty());
      freevoxelDone(folder, {"verify", "a.fvx"});
      std::filesystem::remove(folder + "/a.fvx");
      continue;
    }
    ++killed;
    const std::vector<std::string> left = temporaries(folder);
    EXPECT_LE(left.size(), 1u) << "the run before has removed what the one before it left";
    whileWriting += left.empty() ? 0 : 1;
    for (const std::string& name : left) {
      EXPECT_EQ(freevoxel(folder, {"info", name}).status, kFailed);
      EXPECT_EQ(freevoxel(folder, {"verify", name}).status, kFailed);
    }
  }
  EXPECT_GE(killed, kKilled);
  EXPECT_GE(whileWriting, kWhileWriting);
  freevoxelDone(folder, call);
  EXPECT_EQ(listFolder(folder), (std::vector<std::string>{"a.fvx", "a.nrrd", "t.json"}));
}

/// On a disk of one MiB, in a name space of its own.
TEST(FullDisk, isToldAndLeavesNothing) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "cloud", "--dims", "180,150,120", "-o", "a.nrrd"});
  writeBytes(folder + "/t.json", kHalf);
  std::filesystem::create_directory(folder + "/disk");
  ProcessOptions options;
  options.folder = folder;
  const auto onSmallDisk = [&](const std::string& command) {
    return runProcess({"/usr/bin/unshare", "--map-root-user", "--mount", "/bin/sh", "-c",
                       "mount -t tmpfs -o size=1m none disk && " + command},
                      options);
  };
  if (onSmallDisk("true").status != 0) GTEST_SKIP() << "no disk of its own: unshare or mount is not allowed here";
  for (const std::string layout : {"dense", "compact"}) {
    const ProcessResult result = onSmallDisk("{ '" + programPath() + "' precompute a.nrrd --transfer t.json --layout " +
                                             layout + " -o disk/a.fvx --quiet; status=$?; ls -A disk; exit $status; }");
    EXPECT_EQ(result.status, kFailed) << layout;
    EXPECT_EQ(result.output, "") << "left on the disk";
    EXPECT_NE(result.talk.find("disk/a.fvx"), std::string::npos) << result.talk;
    EXPECT_NE(result.talk.find("No space left on device; free some space"), std::string::npos) << result.talk;
    EXPECT_EQ(std::count(result.talk.begin(), result.talk.end(), '\n'), 1) << result.talk;
  }
}

/// Cut at any moment of a run: the run is done before, or fails with one line.
TEST(CutInput, isToldInOneLine) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "cloud", "--dims", "96,80,72", "-o", "a.nrrd"});
  writeBytes(folder + "/t.json", kHalf);
  int failed = 0, attempt = 0;
  for (const std::string layout : {"dense", "compact"}) {
    freevoxelDone(folder, {"precompute", "a.nrrd", "--transfer", "t.json", "--layout", layout, "-o", "whole.fvx"});
    const auto bytes = std::filesystem::file_size(folder + "/whole.fvx");
    for (const uintmax_t left : {uintmax_t(0), bytes / 2, bytes - 1}) {
      for (const std::string command : {"verify", "render"}) {
        std::filesystem::copy_file(folder + "/whole.fvx", folder + "/cut.fvx",
                                   std::filesystem::copy_options::overwrite_existing);
        std::thread cut([&, wait = 40 + 7 * (attempt++ % 7)] {
          std::this_thread::sleep_for(std::chrono::milliseconds(wait));
          std::filesystem::resize_file(folder + "/cut.fvx", left);
        });
        std::vector<std::string> call = {command, "cut.fvx", "--quiet"};
        if (command == "render") call.insert(call.end(), {"-o", "a.png", "--size", "40x30", "--backend", "cpu"});
        const ProcessResult result = freevoxel(folder, call);
        cut.join();
        EXPECT_TRUE(result.status == 0 || result.status == kFailed) << result.status << ' ' << result.talk;
        if (result.status == 0) continue;
        ++failed;
        EXPECT_EQ(std::count(result.talk.begin(), result.talk.end(), '\n'), 1) << result.talk;
        EXPECT_NE(result.talk.find("cut.fvx"), std::string::npos) << result.talk;
      }
    }
  }
  EXPECT_GE(failed, 1);
}

}  // namespace
}  // namespace freevoxel::test
