// The whole line through the real program, on a small volume that is no cube.
#include <gtest/gtest.h>

#include <fmt/core.h>

#include <cmath>
#include <filesystem>

#include "base/address_sanitizer.h"
#include "base/compare.h"
#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

const char* const kTransfer = R"({"range": [0, 255], "referenceLength": 1.0, "points": [
  {"value": 0, "color": [0.1, 0.2, 0.9], "opacity": 0.0},
  {"value": 40, "color": [0.9, 0.5, 0.1], "opacity": 0.1},
  {"value": 255, "color": [1.0, 1.0, 0.9], "opacity": 0.6}]})";

/// A folder with cloud.nrrd (5 x 7 x 11, spacing 0.3,1.1,2.7), t.json and cloud.fvx; made once.
class Pipeline : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = temporaryFolder();
    writeBytes(folder + "/t.json", kTransfer);
    run("generate checkered-cloud --dims 5,7,11 --spacing 0.3,1.1,2.7 --seed 7 -o cloud.nrrd --stats generate.json");
    run("precompute cloud.nrrd --transfer t.json -o cloud.fvx --stats precompute.json");
  }

  static ProcessResult run(const std::string& call) { return freevoxelDone(folder, words(call)); }
  static void expectIdentical(const std::string& a, const std::string& b) {
    EXPECT_TRUE(compareImages(readImage(folder + "/" + a), readImage(folder + "/" + b)).identical) << a << " " << b;
  }

  static inline std::string folder;
};

constexpr const char* kView = " --size 61x43 --orbit 35,25 ";

TEST_F(Pipeline, infoTellsOfTheVolume) {
  const auto json = nlohmann::json::parse(run("info cloud.nrrd --json").output);
  EXPECT_EQ(json["dims"], (nlohmann::json{5, 7, 11}));
  EXPECT_EQ(json["spacing"], (nlohmann::json{0.3, 1.1, 2.7}));
  EXPECT_EQ(json["origin"], (nlohmann::json{0.0, 0.0, 0.0}));
  EXPECT_EQ(json["type"], "u8");
  EXPECT_LT(json["range"][0], json["range"][1]);
  EXPECT_GT(json["sum"], 0.0);
  EXPECT_EQ(json["nonFinite"], 0);
  EXPECT_EQ(json["fileBytes"], readBytes(folder + "/cloud.nrrd").size());
  EXPECT_EQ(json.size(), 10u);
  const std::string text = run("info cloud.nrrd").output;
  EXPECT_NE(text.find("385 voxels"), std::string::npos) << text;
  EXPECT_NE(text.find('#'), std::string::npos) << text;  // a histogram
}

TEST_F(Pipeline, infoTellsOfTheAttenuationFile) {
  run("precompute cloud.nrrd --transfer t.json --classification voxel -o voxel.fvx");
  const auto json = nlohmann::json::parse(run("info voxel.fvx --json").output);
  EXPECT_EQ(json["dims"], (nlohmann::json{5, 7, 11}));
  EXPECT_EQ(json["spacing"], (nlohmann::json{0.3, 1.1, 2.7}));
  EXPECT_EQ(json["layout"], "dense");
  EXPECT_EQ(json["classification"], "voxel");
  EXPECT_EQ(json["levels"], 1);
  EXPECT_EQ(json["bricks"], 1);
  EXPECT_EQ(json["storedVoxels"], 385);
  EXPECT_EQ(json["fileBytes"], readBytes(folder + "/voxel.fvx").size());
  EXPECT_NE(run("info voxel.fvx").output.find("freevoxel precompute cloud.nrrd"), std::string::npos);
}

// The box stays: 1.5 x 7.7 x 29.7, cut into voxels as near to cubes as it goes.
TEST_F(Pipeline, precomputeResamples) {
  run("precompute cloud.nrrd --transfer t.json --resolution 12 -o coarse.fvx");
  const auto json = nlohmann::json::parse(run("info coarse.fvx --json").output);
  EXPECT_EQ(json["dims"], (nlohmann::json{1, 3, 12}));
  EXPECT_NEAR(json["spacing"][0], 1.5, 1e-12);
  EXPECT_NEAR(json["spacing"][1], 7.7 / 3, 1e-12);
  EXPECT_NEAR(json["spacing"][2], 29.7 / 12, 1e-12);
  expectRefusal(folder, words("precompute cloud.nrrd --transfer t.json --resolution 12 --memory 64M -o no.fvx"), 2,
                "--resolution");
}

TEST_F(Pipeline, verifyFindsAFlippedByte) {
  EXPECT_NE(run("verify cloud.fvx").output.find("ok"), std::string::npos);
  EXPECT_NE(run("verify cloud.nrrd").output.find("ok"), std::string::npos);
  std::string bytes = readBytes(folder + "/cloud.fvx");
  bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
  writeBytes(folder + "/damaged.fvx", bytes);
  expectRefusal(folder, words("verify damaged.fvx"), 1, "damaged.fvx");
}

TEST_F(Pipeline, ordersThreadsAndBackendsGiveTheSameBits) {
  for (const std::string formula : {"paper", "direct", "normalised"}) {
    if (kUnderAddressSanitizer && formula != "normalised") continue;  // ten runs of the program for each
    const std::string call = "render cloud.fvx --formula " + formula + kView;
    run(call + "--backend cpu -o a.exr --sums a_sums.exr");
    for (const std::string order : {"hilbert", "reverse", "shuffle:1", "shuffle:2"}) {
      for (const std::string backend : {"cpu", "gl"}) {
        if (order == "hilbert" && backend == "cpu") continue;
        run(call + "--threads 3 --backend " + backend + " --order " + order + " -o b.exr --sums b_sums.exr");
        expectIdentical("a_sums.exr", "b_sums.exr");
        expectIdentical("a.exr", "b.exr");
      }
    }
    for (const std::string threads : {"1", "2"}) {
      run(call + "--backend cpu --threads " + threads + " -o b.exr --sums b_sums.exr");
      expectIdentical("a_sums.exr", "b_sums.exr");
    }
  }
}

TEST_F(Pipeline, orthographicToo) {
  run("render cloud.fvx --size 61x43 --orthographic 0 --orbit 35,25 --backend cpu -o a.exr");
  run("render cloud.fvx --size 61x43 --orthographic 0 --orbit 35,25 --backend gl --order reverse -o b.exr");
  expectIdentical("a.exr", "b.exr");
}

TEST_F(Pipeline, precomputeDoesNotDependOnThreads) {
  const std::string made = "precompute cloud.nrrd --transfer t.json -o same.fvx --threads ";
  run(made + "1");
  const std::string one = readBytes(folder + "/same.fvx");
  for (const char* threads : {"2", "3", "8"}) {
    run(made + threads);
    // The recorded command names the threads; its checksum and those of the tables follow. Sizes and data must agree.
    const std::string other = readBytes(folder + "/same.fvx");
    ASSERT_EQ(other.size(), one.size());
    size_t different = 0;
    for (size_t i = 0; i < one.size(); ++i)
      different += one[i] != other[i];
    EXPECT_LE(different, 1u + 8u + 8u) << threads;
  }
}

TEST_F(Pipeline, aVolumeIsDrawnLikeItsAttenuationFile) {
  run(std::string("render cloud.fvx --attenuation stored -o a.exr") + kView);
  const ProcessResult direct =
      run(std::string("render cloud.nrrd --attenuation stored --transfer t.json -o b.exr") + kView);
  EXPECT_NE(direct.talk.find("precomput"), std::string::npos);
  expectIdentical("a.exr", "b.exr");
  run(std::string("render cloud.fvx --formula raycast -o c.exr") + kView);
  run(std::string("render cloud.nrrd --formula raycast --transfer t.json -o d.exr") + kView);
  expectIdentical("c.exr", "d.exr");
  for (const std::string& name : listFolder(folder))
    EXPECT_FALSE(name.starts_with(".")) << name;
}

TEST_F(Pipeline, rawFilesCarryTheSameValues) {
  run("generate checkered-cloud --dims 5,7,11 --seed 7 -o cloud.raw");
  const auto raw =
      nlohmann::json::parse(run("info cloud.raw --dims 5,7,11 --type u8 --spacing 0.3,1.1,2.7 --json").output);
  const auto nrrd = nlohmann::json::parse(run("info cloud.nrrd --json").output);
  for (const char* key : {"dims", "spacing", "origin", "type", "range", "sum"})
    EXPECT_EQ(raw[key], nrrd[key]) << key;
}

TEST_F(Pipeline, compressedVolumesCarryTheSameValues) {
  run("generate checkered-cloud --dims 5,7,11 --spacing 0.3,1.1,2.7 --seed 7 --compress -o packed.nrrd");
  const auto packed = nlohmann::json::parse(run("info packed.nrrd --json").output);
  EXPECT_EQ(packed["sum"], nlohmann::json::parse(run("info cloud.nrrd --json").output)["sum"]);
}

TEST_F(Pipeline, statisticsHaveTheirKeys) {
  run(std::string("render cloud.fvx --backend cpu --threads 2 -o a.png --stats render.json") + kView);
  run("compare a.png a.png --stats compare.json");
  const auto generated = readJson(folder + "/generate.json");
  const auto precomputed = readJson(folder + "/precompute.json");
  const auto rendered = readJson(folder + "/render.json");
  const auto compared = readJson(folder + "/compare.json");
  for (const auto& json : {generated, precomputed, rendered, compared}) {
    for (const char* key : {"command", "version", "seconds", "threads", "peakMemoryBytes", "warnings"}) {
      EXPECT_TRUE(json.contains(key)) << key << " in " << json;
    }
    EXPECT_GE(json["seconds"]["total"], 0.0);
    EXPECT_GT(json["peakMemoryBytes"], 1000000);
    EXPECT_TRUE(json["command"].get<std::string>().starts_with("freevoxel "));
  }
  for (const char* key : {"voxels", "storedVoxels", "fileBytes", "bytesPerVoxel", "nonFinite", "blocks"}) {
    EXPECT_TRUE(precomputed.contains(key)) << key;
    EXPECT_TRUE(rendered.contains(key)) << key;
  }
  for (const char* key : {"backend", "splats", "culledSplats", "fragments", "quantum"}) {
    EXPECT_TRUE(rendered.contains(key)) << key;
  }
  EXPECT_EQ(rendered["backend"], "cpu");
  EXPECT_EQ(rendered["threads"], 2);
  EXPECT_EQ(rendered["voxels"], 385);
  EXPECT_EQ(compared["identical"], true);
}

TEST_F(Pipeline, imagesHoldTheCommandThatMadeThem) {
  for (const std::string name : {"a b.png", "a b.exr"}) {
    freevoxelDone(folder, {"render", "cloud.fvx", "--size", "61x43", "--background", "#102030", "-o", name});
    EXPECT_EQ(readImageCommand(folder + "/" + name),
              "freevoxel render cloud.fvx --size 61x43 --background '#102030' -o '" + name + "'");
  }
}

TEST_F(Pipeline, backgrounds) {
  const std::string call = std::string("render cloud.fvx") + kView;
  run(call + "-o black.png");
  run(call + "-o also_black.png --background 0,0,0");
  expectIdentical("black.png", "also_black.png");
  run(call + "-o white.png --background white");
  const Image white = readImage(folder + "/white.png");
  EXPECT_EQ(white.channels, 3);
  EXPECT_EQ(white.at(0, 0)[1], 1.0f);
  run(call + "-o clear.png --background transparent");
  EXPECT_EQ(readImage(folder + "/clear.png").channels, 4);
  run(call + "-o clear.exr");
  EXPECT_EQ(readImage(folder + "/clear.exr").at(0, 0)[3], 0.0f);
  run(call + "-o blue.exr --background #0000ff");
  const Image blue = readImage(folder + "/blue.exr");
  EXPECT_EQ(blue.at(0, 0)[2], 1.0f);
  EXPECT_EQ(blue.at(0, 0)[3], 0.0f);  // alpha is the volume's
}

TEST_F(Pipeline, compareJudges) {
  run(std::string("render cloud.fvx -o a.exr") + kView);
  run(std::string("render cloud.fvx --formula raycast -o r.exr") + kView);
  const auto json = nlohmann::json::parse(run("compare a.exr r.exr --json --diff d.png --gain 4").output);
  EXPECT_EQ(json["identical"], false);
  for (const char* key : {"psnr", "ssim", "rms", "maxError", "differingBytes"}) {
    EXPECT_TRUE(json[key].is_number()) << key;
  }
  EXPECT_EQ(readImage(folder + "/d.png").size, glm::ivec2(61, 43));
  EXPECT_EQ(freevoxel(folder, words("compare a.exr r.exr --identical")).status, 1);
  EXPECT_EQ(freevoxel(folder, words("compare a.exr r.exr --min-psnr 900")).status, 1);
  EXPECT_EQ(freevoxel(folder, words("compare a.exr r.exr --min-psnr 1")).status, 0);
  EXPECT_EQ(freevoxel(folder, words("compare a.exr a.exr --min-psnr 900 --identical")).status, 0);
  EXPECT_EQ(nlohmann::json::parse(run("compare a.exr a.exr --json").output)["psnr"], 999.0);
}

TEST_F(Pipeline, compareReadsPngBesideExr) {
  run(std::string("render cloud.fvx -o a.exr") + kView);
  run(std::string("render cloud.fvx -o a.png") + kView);
  const ProcessResult result = run("compare a.png a.exr --json --min-psnr 45");
  EXPECT_NE(result.talk.find("alpha"), std::string::npos);
}

TEST_F(Pipeline, transferFunctionsOfOtherOpacityAreRefused) {
  std::string other = kTransfer;
  other.replace(other.find("0.6}"), 4, "0.7}");
  writeBytes(folder + "/other.json", other);
  expectRefusal(folder, words("render cloud.fvx --transfer other.json -o a.png"), 1, "freevoxel precompute VOLUME");
  std::string recoloured = kTransfer;
  recoloured.replace(recoloured.find("[1.0, 1.0, 0.9]"), 15, "[0.0, 1.0, 0.0]");
  writeBytes(folder + "/recoloured.json", recoloured);
  run(std::string("render cloud.fvx -o a.exr") + kView);
  run(std::string("render cloud.fvx --transfer recoloured.json -o b.exr") + kView);
  const Image before = readImage(folder + "/a.exr"), after = readImage(folder + "/b.exr");
  double red[2] = {}, alphaChange = 0.0;
  for (size_t i = 0; i < before.pixels.size(); i += 4) {
    red[0] += before.pixels[i];
    red[1] += after.pixels[i];
    alphaChange = std::max(alphaChange, double(std::abs(before.pixels[i + 3] - after.pixels[i + 3])));
  }
  EXPECT_LT(red[1], 0.9 * red[0]) << "the new colours are used";
  EXPECT_EQ(alphaChange, 0.0);
  // A colour picked half-way, on the line of opacities that was there.
  recoloured.replace(recoloured.find("{\"value\": 255"), 0,
                     R"({"value": 147.5, "color": [0.2, 0.9, 0.1], "opacity": 0.35}, )");
  writeBytes(folder + "/recoloured.json", recoloured);
  run(std::string("render cloud.fvx --transfer recoloured.json -o b.exr") + kView);
}

TEST_F(Pipeline, layoutsGiveNearlyTheSamePicture) {
  const std::vector<std::string> ways = {"--formula direct", "--formula paper", "--light-direction 1,2,3"};
  for (size_t way = 0; way < ways.size(); ++way)
    run("render cloud.fvx " + ways[way] + kView + fmt::format("-o dense{}.exr", way));
  for (const std::string edge : {"16", "32"}) {
    run("precompute cloud.nrrd --transfer t.json --layout compact --brick " + edge + " -o compact.fvx");
    run("verify compact.fvx");
    const auto json = nlohmann::json::parse(run("info compact.fvx --json").output);
    EXPECT_EQ(json["layout"], "compact");
    EXPECT_EQ(json["occupancy"], 1.0);
    EXPECT_LT(json["attenuationBytes"], 385 * 26);
    EXPECT_EQ(json["attenuationBytesPerVoxel"], json["attenuationBytes"].get<double>() / 385);
    EXPECT_EQ(json["valueBytesPerStoredVoxel"], json["valueBytes"].get<double>() / 385);
    for (size_t way = 0; way < ways.size(); ++way) {
      run("render compact.fvx " + ways[way] + kView + "-o b.exr");
      const Image dense = readImage(folder + fmt::format("/dense{}.exr", way));
      EXPECT_GE(compareImages(dense, readImage(folder + "/b.exr")).psnr, 50.0) << edge << ' ' << ways[way];
    }
  }
}

TEST_F(Pipeline, quietSaysNothing) {
  const ProcessResult result = run(std::string("render cloud.nrrd --transfer t.json --quiet -o a.png") + kView);
  EXPECT_EQ(result.output, "");
  EXPECT_EQ(result.talk, "");
}

TEST_F(Pipeline, progressivePicturesEndInTheDirectOne) {
  run("generate cloud --dims 100,40,130 --seed 3 -o large.nrrd");
  run("precompute large.nrrd --transfer t.json --levels 0 --brick 8 -o large.fvx");
  run("render large.fvx --size 61x43 -o direct.exr --sums direct.sums.exr");
  run("render large.fvx --size 61x43 -o last.exr --sums last.sums.exr --progressive steps --stats steps.json");
  expectIdentical("last.exr", "direct.exr");
  expectIdentical("last.sums.exr", "direct.sums.exr");
  const auto stats = nlohmann::json::parse(readBytes(folder + "/steps.json"));
  const int pictures = stats["pictures"];
  EXPECT_GE(pictures, 9);
  expectIdentical(fmt::format("steps/{:02}.exr", pictures - 1), "direct.exr");
  EXPECT_LT(compareImages(readImage(folder + "/steps/00.exr"), readImage(folder + "/direct.exr")).psnr, 40.0);
  EXPECT_FALSE(std::filesystem::exists(folder + fmt::format("/steps/{:02}.exr", pictures)));
  // Another run leaves its own pictures only: of other size and format here, and one number more than there are.
  std::filesystem::copy_file(folder + "/steps/00.exr", folder + fmt::format("/steps/{:02}.exr", pictures));
  writeBytes(folder + "/steps/notes.txt", "mine");
  const ProcessResult again = run("render large.fvx --size 31x23 -o last.png --progressive steps --stats again.json");
  EXPECT_NE(again.talk.find(fmt::format("steps: removing {} pictures of an earlier run", pictures + 1)),
            std::string::npos)
      << again.talk;
  std::vector<std::string> left = {"notes.txt"};
  for (int i = readJson(folder + "/again.json")["pictures"].get<int>() - 1; i >= 0; --i)
    left.insert(left.begin(), fmt::format("{:02}.png", i));
  EXPECT_EQ(listFolder(folder + "/steps"), left);
  // A picture that no such run wrote stays, and so does all else.
  std::filesystem::copy_file(folder + "/direct.exr", folder + "/steps/77.exr");
  expectRefusal(folder, words("render large.fvx -o x.png --progressive steps"), kFailed, "steps/77.exr: is in the way");
  left.insert(left.end() - 1, "77.exr");
  EXPECT_EQ(listFolder(folder + "/steps"), left);
  // What has no levels, or no sums to take back, is told so.
  const auto refused = [](const std::string& call, int status, const std::string& expected) {
    expectRefusal(folder, words(call + " -o x.png --progressive refused"), status, expected);
  };
  refused("render cloud.fvx", kFailed, "--levels 0");
  refused("render cloud.nrrd --transfer t.json", kUsage, "--progressive needs an attenuation file");
  refused("render large.fvx --frames 3", kUsage, "leave --frames out");
  refused("render large.fvx --formula raycast", kUsage, "--progressive needs --formula");
  refused("render large.fvx --attenuation swept", kFailed, "finest level only");
}

}  // namespace
}  // namespace freevoxel::test
