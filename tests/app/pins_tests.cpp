// Pins through the program: made, listed, checked, used.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "base/compare.h"
#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

constexpr const char* kPinsTransfer =
    R"({"range": [0, 255], "points": [{"value": 0, "color": [0, 0, 1], "opacity": 0},
        {"value": 255, "color": [1, 1, 0], "opacity": 0.7}]})";
constexpr const char* kPins = " --pin-light 9,8,7 --pin-direction=-1,0.5,0.25 --pin-light 3,-4,0 ";
constexpr const char* kPinsView = " --size 41x33 --eye 9,8,7 --light-direction=-2,1,0.5 --light 3,-4,0,1,0.2,0.1 ";

class Pins : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = temporaryFolder();
    writeBytes(folder + "/t.json", kPinsTransfer);
    run("generate cloud --dims 7,5,11 --spacing 0.3,1.1,0.7 -o cloud.nrrd");
    run("precompute cloud.nrrd --transfer t.json -o plain.fvx");
  }
  static ProcessResult run(const std::string& call) { return freevoxelDone(folder, words(call)); }

  static inline std::string folder;
};

TEST_F(Pins, giveThePictureOfSweepsInBothLayouts) {
  run(std::string("render plain.fvx --attenuation swept --light-attenuation swept -o swept.exr") + kPinsView);
  const Image swept = readImage(folder + "/swept.exr");
  for (const std::string layout : {"dense", "compact"}) {
    run("precompute cloud.nrrd --transfer t.json --layout " + layout + kPins + "-o pinned.fvx --stats made.json");
    run("verify pinned.fvx");
    const auto info = nlohmann::json::parse(run("info pinned.fvx --json").output);
    ASSERT_EQ(info["pins"].size(), 3u);
    EXPECT_EQ(info["pins"][0]["position"], (nlohmann::json{9.0, 8.0, 7.0}));
    EXPECT_EQ(info["pins"][1]["position"], (nlohmann::json{3.0, -4.0, 0.0}));
    EXPECT_EQ(info["pins"][2]["direction"], (nlohmann::json{-1.0, 0.5, 0.25}));
    EXPECT_GT(info["pinBytes"], 3 * 40);
    EXPECT_EQ(info["pinBytesPerVoxel"], info["pinBytes"].get<double>() / 385);
    const auto made = nlohmann::json::parse(readBytes(folder + "/made.json"));
    EXPECT_EQ(made["pins"], 3);
    EXPECT_EQ(made["fileBytes"], readBytes(folder + "/pinned.fvx").size());
    for (const std::string source : {"", "--attenuation pinned --light-attenuation pinned "}) {
      run("render pinned.fvx " + source + "--stats drawn.json -o pinned.exr" + kPinsView);
      EXPECT_TRUE(compareImages(swept, readImage(folder + "/pinned.exr")).identical) << layout << ' ' << source;
      const auto drawn = nlohmann::json::parse(readBytes(folder + "/drawn.json"));
      EXPECT_EQ(drawn["attenuation"], "pinned");
      EXPECT_EQ(drawn["lightAttenuation"], "pinned");
    }
  }
}

TEST_F(Pins, doNotDependOnThreadsOrMemory) {
  // The command that made it is in the file too, so only its end is compared: most of the pins' sections.
  const auto end = [](const std::string& how) {
    run("precompute cloud.nrrd --transfer t.json -o one.fvx " + how + kPins);
    const std::string bytes = readBytes(folder + "/one.fvx");
    return bytes.substr(bytes.size() - 600);
  };
  const std::string expected = end("--threads 1");
  EXPECT_EQ(end("--threads 3"), expected);
  EXPECT_EQ(end("--memory 80M"), expected);
}

TEST_F(Pins, leaveNothingBehind) {
  run(std::string("precompute cloud.nrrd --transfer t.json -o alone.fvx") + kPins);
  for (const std::string& name : listFolder(folder))
    EXPECT_EQ(name.find("unpinned"), std::string::npos) << name;
}

TEST_F(Pins, areRefusedWhereTheyMakeNoSense) {
  const std::string make = "precompute cloud.nrrd --transfer t.json -o refused.fvx ";
  expectRefusal(folder, words(make + "--pin-direction 0,0,0"), 2, "--pin-direction");
  expectRefusal(folder, words(make + "--pin-light 1,2"), 2, "--pin-light");
  expectRefusal(folder, words(make + "--pin-light 1,2,nan"), 2, "--pin-light");
  expectRefusal(folder, words("render plain.fvx --attenuation pinned -o a.png"), 1, "--pin-light");
  expectRefusal(folder, words("render cloud.nrrd --transfer t.json --attenuation pinned -o a.png"), 2, "--pin-light");
  expectRefusal(folder, words("render plain.fvx --light-attenuation pinned --light-direction 1,2,3 -o a.png"), 1,
                "--pin-direction");
}

}  // namespace
}  // namespace freevoxel::test
