// What the program says to calls that make no sense and to files that will not do.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

const std::vector<std::string> kCommands = {"generate", "precompute", "transfer", "info",
                                            "verify",   "render",     "compare",  "sheet"};

TEST(CommandLine, helpOfEveryCommandGoesToStdout) {
  const ProcessResult program = freevoxelDone("", {"--help"});
  EXPECT_EQ(program.talk, "");
  for (const std::string& command : kCommands) {
    EXPECT_NE(program.output.find("\n  " + command + " "), std::string::npos) << command;
    const ProcessResult help = freevoxelDone("", {command, "--help"});
    EXPECT_EQ(help.talk, "");
    for (const char* text : {"Usage: freevoxel ", "Example:\n  freevoxel ", "--threads N", "--quiet", "--stats"}) {
      EXPECT_NE(help.output.find(text), std::string::npos) << command << ": " << text;
    }
  }
}

TEST(CommandLine, versionIsTheProjects) {
  EXPECT_TRUE(freevoxelDone("", {"--version"}).output.starts_with("freevoxel 0."));
}

TEST(CommandLine, usageErrorsExitTwoWithOneLine) {
  const std::string folder = temporaryFolder();
  const struct {
    const char* call;
    const char* expected;
  } cases[] = {
      {"", "give a command"},
      {"paint", "paint"},
      {"--frobnicate", "frobnicate"},
      {"generate", "KIND"},
      {"generate cube -o a.nrrd", "--dims"},
      {"generate cube --dims 5,7,11", "--output"},
      {"generate dodecahedron --dims 5,7,11 -o a.nrrd", "dodecahedron"},
      {"generate cube --dims 5,7 -o a.nrrd", "'5,7'"},
      {"generate cube --dims 5,7,0 -o a.nrrd", "'5,7,0'"},
      {"generate cube --dims 5,7,-1 -o a.nrrd", "'5,7,-1'"},
      {"generate cube --dims 5,7,9999999999 -o a.nrrd", "9999999999"},
      {"generate cube --dims 5,7,11x -o a.nrrd", "'5,7,11x'"},
      {"generate cube --dims 5,7,11 -o a.tiff", "a.tiff"},
      {"generate cube --dims 5,7,11 -o a.nrrd --seed -3", "--seed"},
      {"generate cube --dims 5,7,11 -o a.nrrd --spacing 1,0,1", "--spacing"},
      {"generate cube --dims 5,7,11 -o a.nrrd --spacing 1,nan,1", "--spacing"},
      {"generate cube --dims 5,7,11 -o a.nrrd --threads 0", "--threads"},
      {"generate cube --dims 5,7,11 -o a.nrrd --threads many", "'many'"},
      {"generate cube --dims 5,7,11 -o a.raw --compress", "--compress"},
      {"precompute a.nrrd -o a.fvx", "--transfer"},
      {"precompute a.nrrd --transfer t.json -o a.fvx --brick 12", "8|16|32"},
      {"precompute a.nrrd --transfer t.json -o a.fvx --classification guess", "voxel|preintegrated"},
      {"info a.raw --type u9", "'u9'"},
      {"info a.raw --endian middle", "little|big"},
      {"info a.raw --skip 4Q", "'4Q'"},
      {"info a.raw --skip 99999999999G", "--skip"},
      {"render a.fvx", "--output"},
      {"render a.fvx -o a.jpg", "a.jpg"},
      {"render a.fvx -o a.png --sums a.png", "--sums"},
      {"render a.fvx -o a.png --size 100", "'100'"},
      {"render a.fvx -o a.png --size 0x100", "'0x100'"},
      {"render a.fvx -o a.png --size 100x99999", "32768"},
      {"render a.fvx -o a.png --fov 180", "--fov"},
      {"render a.fvx -o a.png --orbit 30", "--orbit"},
      {"render a.fvx -o a.png --orbit 30,91", "--orbit"},
      {"render a.fvx -o a.png --orbit 30,20,0", "--orbit"},
      {"render a.fvx -o a.png --orbit 30,20 --eye 1,2,3", "--eye"},
      {"render a.fvx -o a.png --target 1,2,3", "--eye"},
      {"render a.fvx -o a.png --orthographic -1", "--orthographic"},
      {"render a.fvx -o a.png --order sideways", "'sideways'"},
      {"render a.fvx -o a.png --order shuffle:x", "'x'"},
      {"render a.fvx -o a.png --background puce", "'puce'"},
      {"render a.fvx -o a.png --background #12345", "'#12345'"},
      {"render a.fvx -o a.png --background 0,0,2", "'0,0,2'"},
      {"render a.fvx -o a.png --formula guess", "normalised|direct|paper|blended|raycast"},
      {"render a.fvx -o a.png --step 0.5", "--formula raycast"},
      {"render a.fvx -o a.png --raycast pre", "--formula raycast"},
      {"render a.fvx -o a.png --formula raycast --step 0", "--step"},
      {"render a.fvx -o a.png --formula raycast --order reverse", "--order"},
      {"compare a.png", "B"},
      {"compare a.png b.png --min-psnr much", "'much'"},
      {"compare a.png b.png --gain 2", "--diff"},
      {"verify a.fvx b.fvx", "b.fvx"},
  };
  for (const auto& [call, expected] : cases)
    expectRefusal(folder, words(call), kUsage, expected);
  EXPECT_TRUE(listFolder(folder).empty());
}

TEST(CommandLine, missingFilesExitOneWithOneLine) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "sphere", "--dims", "5,7,11", "-o", "a.nrrd"});
  writeBytes(folder + "/t.json",
             R"({"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0.5}]})");
  for (const char* call :
       {"info missing.nrrd", "verify missing.fvx", "render missing.fvx -o a.png", "compare missing.png missing.exr",
        "precompute missing.nrrd --transfer t.json -o a.fvx", "precompute a.nrrd --transfer missing.json -o a.fvx",
        "precompute a.nrrd --transfer t.json -o missing/a.fvx", "render a.nrrd --transfer missing.json -o a.png",
        "render a.nrrd --transfer t.json -o missing/a.png --quiet", "info a.nrrd --json --stats missing/s.json"}) {
    const ProcessResult result = freevoxel(folder, words(call));
    EXPECT_EQ(result.status, kFailed) << call;
    EXPECT_EQ(std::count(result.talk.begin(), result.talk.end(), '\n'), 1) << call << ": " << result.talk;
    EXPECT_NE(result.talk.find("missing"), std::string::npos) << call << ": " << result.talk;
  }
  expectRefusal(folder, words("generate sphere --dims 5,7,11 -o missing/a.nrrd"), kFailed, "missing/a.nrrd");
  expectRefusal(folder, words("info ."), kFailed, ".");
  EXPECT_EQ(listFolder(folder), (std::vector<std::string>{"a.nrrd", "t.json"}));
}

TEST(CommandLine, filesOfTheWrongKindExitOne) {
  const std::string folder = temporaryFolder();
  writeBytes(folder + "/empty", "");
  writeBytes(folder + "/text.nrrd", "this is no volume\n");
  writeBytes(folder + "/broken.json", "{\"range\": [0, 1],\n \"points\" [}");
  freevoxelDone(folder, {"generate", "sphere", "--dims", "5,7,11", "-o", "a.nrrd"});
  expectRefusal(folder, words("info empty"), kFailed, "empty");
  expectRefusal(folder, words("verify text.nrrd"), kFailed, "text.nrrd");
  expectRefusal(folder, words("compare a.nrrd a.nrrd"), kFailed, "neither a PNG nor an EXR");
  expectRefusal(folder, words("precompute a.nrrd --transfer broken.json -o a.fvx"), kFailed, "broken.json");
  EXPECT_EQ(listFolder(folder).size(), 4u);
}

TEST(CommandLine, valuesMayStartWithAMinus) {
  const std::string folder = temporaryFolder();
  writeBytes(folder + "/t.json",
             R"({"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0.5}]})");
  freevoxelDone(folder, {"generate", "sphere", "--dims", "5,7,11", "-o", "a.nrrd"});
  freevoxelDone(folder, words("precompute a.nrrd --transfer t.json -o a.fvx"));
  freevoxelDone(folder, words("render a.fvx -o a.png --size 20x30 --orbit -30,-20"));
  freevoxelDone(folder, words("render a.fvx -o b.png --size 20x30 --eye -30,-20,4 --target -1,-1,-1"));
}

TEST(CommandLine, aFullDiskBehindStdoutIsAnError) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full here";
  const ProcessResult result = runProcess({"/bin/sh", "-c", "'" + programPath() + "' --help > /dev/full"});
  EXPECT_EQ(result.status, kFailed);
  EXPECT_EQ(result.talk, "freevoxel: cannot write to standard output\n");
}

}  // namespace
}  // namespace freevoxel::test
