// Scene files and the trace command, through the real program.
#include <gtest/gtest.h>

#include "base/compare.h"
#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

/// A folder with cloud.nrrd (13 x 17 x 11), t.json and scene.json; made once.
class Scenes : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = temporaryFolder();
    writeBytes(folder + "/t.json",
               R"({"range": [0, 255], "points": [{"value": 20, "color": [0.2, 0.4, 1], "opacity": 0},
                                               {"value": 255, "color": [1, 0.8, 0.2], "opacity": 0.8}]})");
    run("generate cloud --dims 13,17,11 --spacing 1,1,1.5 -o cloud.nrrd");
    writeBytes(folder + "/scene.json", scene());
  }
  static std::string scene() {
    return "{\n"
           "  \"volume\": {\"file\": \"cloud.nrrd\"},\n"
           "  \"transfer\": \"t.json\",\n"
           "  \"camera\": {\"orbit\": [35, 25], \"fov\": 25},\n"
           "  \"image\": {\"size\": [61, 43], \"background\": \"#204060\"},\n"
           "  \"lights\": [{\"direction\": [1, 1, 0.4], \"color\": [1, 0.9, 0.8]},\n"
           "             {\"position\": [-90, 50, 20]}],\n"
           "  \"ambient\": 0.2,\n"
           "  \"shading\": \"phong\"\n"
           "}\n";
  }
  static ProcessResult run(const std::string& call) { return freevoxelDone(folder, words(call)); }
  static void expectIdentical(const std::string& a, const std::string& b) {
    EXPECT_TRUE(compareImages(readImage(folder + "/" + a), readImage(folder + "/" + b)).identical) << a << " " << b;
  }
  /// The scene with `from` replaced by `to` is refused with a text that holds `expected`.
  static void expectWrong(const std::string& from, const std::string& to, const std::string& expected) {
    std::string text = scene();
    ASSERT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
    writeBytes(folder + "/wrong.json", text);
    for (const char* command : {"trace", "render"})
      expectRefusal(folder, words(std::string(command) + " wrong.json -o wrong.png"), 1, expected);
  }

  static inline std::string folder;
};

const std::string kOptions =
    "cloud.nrrd --transfer t.json --orbit 35,25 --fov 25 --size 61x43 --background #204060 "
    "--light-direction 1,1,0.4,1,0.9,0.8 --light -90,50,20 --ambient 0.2 --shading phong ";

TEST_F(Scenes, sayWhatOptionsSay) {
  for (const std::string command : {"trace", "render"}) {
    run(command + " scene.json --backend cpu -o a.exr");
    run(command + " " + kOptions + "--backend cpu -o b.exr");
    // Lamps add in another order.
    EXPECT_GE(compareImages(readImage(folder + "/a.exr"), readImage(folder + "/b.exr")).psnr, 60.0) << command;
  }
}

TEST_F(Scenes, areOverriddenByOptions) {
  run("trace scene.json --orbit -10,5 --size 30x50 --ambient 0.7 --shading none --light 9,9,90 -o a.exr --backend cpu");
  run("trace cloud.nrrd --transfer t.json --fov 25 --background #204060 --orbit -10,5 --size 30x50 --ambient 0.7 "
      "--light 9,9,90 -o b.exr --backend cpu");
  expectIdentical("a.exr", "b.exr");
}

TEST_F(Scenes, areCheckedWithTheLineAndWhatWasExpected) {
  expectWrong("25}", "250}", "wrong.json: line 4: camera.fov: expected a number in");
  expectWrong("[61, 43]", "[61]", "wrong.json: line 5: image.size: expected [width, height]");
  expectWrong("[61, 43]", "[61, 0.5]", "line 5: image.size[1]: expected a whole number in 1..32768");
  expectWrong("#204060", "bluish", "line 5: image.background");
  expectWrong("\"position\"", "\"place\"", "line 7: lights[1]: unknown key 'place'");
  expectWrong("[-90, 50, 20]", "[-90,\n 50, null]", "line 8: lights[1].position[2]: expected a number");
  expectWrong("\"phong\"", "\"gouraud\"", "line 9: shading: expected one of none, lambert, phong, found 'gouraud'");
  expectWrong("\"orbit\"", "\"eye\": [1, 2, 3], \"orbit\"", "line 4: camera: expected either 'orbit' or 'eye'");
  expectWrong("\"file\": \"cloud.nrrd\"", "", "line 2: volume: expected a key 'file'");
  expectWrong("\"cloud.nrrd\"", "\"absent.nrrd\"", "absent.nrrd");
  expectWrong("0.2,\n", "0.2\n", "line 9");
  expectWrong("0.2,\n", "0.2, \"ambient\": 1,\n", "given twice");
}

TEST_F(Scenes, traceTellsWhatItDid) {
  run("trace scene.json --backend cpu --turn 2 -o a.png --stats s.json");
  const auto json = readJson(folder + "/s.json");
  for (const char* key :
       {"backend", "voxels", "storedVoxels", "bricks", "occupiedBricks", "bufferBytes", "bytesPerStoredVoxel", "builds",
        "passes", "frameSeconds", "framesPerSecond", "raysPerSecond"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["builds"], 1);
  EXPECT_EQ(json["voxels"], 13 * 17 * 11);
  EXPECT_EQ(json["frameSeconds"].size(), 4u);
}

TEST_F(Scenes, editsBuildAgainOnlyIfTheyMust) {
  const auto edit = [&](const char* value, const char* opacity) {
    writeBytes(folder + "/e.json",
               std::string(R"({"range": [0, 255], "points": [{"value": )") + value +
                   R"(, "color": [1, 0, 0], "opacity": 0}, {"value": 255, "color": [0, 1, 0], "opacity": )" + opacity +
                   "}]}");
    run("trace scene.json --edit e.json --backend cpu -o a.exr --stats s.json");
    run("trace scene.json --transfer e.json --backend cpu -o b.exr");
    EXPECT_GE(compareImages(readImage(folder + "/a.exr"), readImage(folder + "/b.exr")).psnr, 90.0);
    return readJson(folder + "/s.json")["builds"].get<int>();
  };
  EXPECT_EQ(edit("60", "0.3"), 1);
  EXPECT_EQ(edit("2", "0.9"), 2);
}

TEST_F(Scenes, traceReadsAttenuationFiles) {
  run("precompute cloud.nrrd --transfer t.json -o cloud.fvx");
  run("trace cloud.fvx --backend cpu --size 61x43 -o a.exr");
  run("trace cloud.nrrd --transfer t.json --backend cpu --size 61x43 -o b.exr");
  expectIdentical("a.exr", "b.exr");
}

TEST_F(Scenes, traceRefusesWhatCannotBe) {
  const std::string trace = "trace cloud.nrrd --transfer t.json -o wrong.png ";
  expectRefusal(folder, words(trace + "--brick 3"), 2, "4|8|16");
  expectRefusal(folder, words(trace + "--resolution 0"), 2, "--resolution");
  expectRefusal(folder, words(trace + "--resolution 99999"), 2, "--resolution");
  expectRefusal(folder, words(trace + "--steps 0"), 2, "--steps");
  expectRefusal(folder, words(trace + "--threshold 1"), 2, "--threshold");
  expectRefusal(folder, words(trace + "--threshold 0.99"), 1, "lower --threshold");
  expectRefusal(folder, words(trace + "--backend gl --gpu-memory 1K"), 1, "--gpu-memory");
  expectRefusal(folder, words("trace cloud.nrrd -o wrong.png"), 2, "--transfer");
}

}  // namespace
}  // namespace freevoxel::test
