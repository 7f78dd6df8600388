// Files of other programs through the whole program: read in a child where a library does it, labels kept apart,
// transfer functions chosen, and nothing written where something is wrong.
#include <gtest/gtest.h>

#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

/// A raw file of 5 x 7 x 11 bytes: label 3 on the left, label 9 on the right, and 0.
void writeLabels(const std::string& path) {
  std::string bytes;
  for (int i = 0; i < 385; ++i)
    bytes += char(i % 5 < 2 ? 3 : i % 5 > 2 ? 9 : 0);
  writeBytes(path, bytes);
}

const std::string kLabels =
    R"({"labels": [{"value": 3, "color": [1,0,0], "opacity": 1}, {"value": 9, "color": [0,0,1], "opacity": 1}]})";

/// Whether a picture has a pixel with more green than a trace.
bool hasGreen(const Image& image) {
  for (size_t i = 0; i < image.pixels.size(); i += 4) {
    if (image.pixels[i + 1] > 1e-3f) return true;
  }
  return false;
}

}  // namespace

TEST(Formats, whatALibraryCannotReadWritesNothing) {
  const std::string folder = temporaryFolder();
  writeBytes(folder + "/a.vdb", "no such thing");
  writeBytes(folder + "/a.tif", std::string("II*\0", 4) + std::string(100, '\xff'));
  writeBytes(folder + "/a.dcm", std::string(128, '\0') + "DICM" + std::string(100, '\xff'));
  const std::vector<std::string> before = listFolder(folder);
  for (const std::string name : {"a.vdb", "a.tif", "a.dcm"}) {
    expectRefusal(folder, {"precompute", name, "--transfer", "auto", "-o", "a.fvx"}, kFailed, name + ": ");
    expectRefusal(folder, {"info", name}, kFailed, name + ": ");
  }
  EXPECT_EQ(listFolder(folder), before);
}

TEST(Formats, aFolderOfSlices) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "cloud", "--dims", "5,7,11", "-o", "cloud.nrrd"});
  expectRefusal(folder, {"info", "."}, kFailed, "neither DICOM files nor");
  freevoxelDone(folder, {"transfer", "cloud.nrrd", "-o", "s1.png", "--size", "300x200"});
  freevoxelDone(folder, {"transfer", "cloud.nrrd", "-o", "s2.png", "--size", "300x200"});
  const auto info = nlohmann::json::parse(freevoxelDone(folder, {"info", "--json", ".", "--component", "R"}).output);
  EXPECT_EQ(info["dims"], nlohmann::json({300, 200, 2}));
}

TEST(Formats, aFrameOfASeries) {
  const std::string folder = temporaryFolder();
  for (const char* seed : {"1", "2"}) {
    freevoxelDone(folder, {"generate", "cloud", "--dims", "9,7,11", "--seed", seed, "-o",
                           std::string("frame_000") + seed + ".nrrd"});
  }
  const std::string first = freevoxelDone(folder, {"info", "--json", "frame_%04d.nrrd", "--frame", "1"}).output;
  EXPECT_NE(first, freevoxelDone(folder, {"info", "--json", "frame_%04d.nrrd", "--frame", "2"}).output);
  expectRefusal(folder, {"info", "frame_%04d.nrrd"}, kFailed, "choose one with --frame 1 to 2");
}

TEST(Formats, labelsAreNotMixed) {
  const std::string folder = temporaryFolder();
  writeLabels(folder + "/labels.raw");
  writeBytes(folder + "/labels.json", kLabels);
  const std::vector<std::string> volume = {"labels.raw", "--dims", "5,7,11", "--type", "u8", "--labels"};
  const auto with = [&](std::vector<std::string> call, const std::vector<std::string>& more) {
    call.insert(call.end(), volume.begin(), volume.end());
    call.insert(call.end(), more.begin(), more.end());
    return call;
  };
  const std::vector<std::string> picture = {"--transfer", "labels.json", "--size", "60x50"};
  const auto render = [&](std::vector<std::string> more) {
    more.insert(more.end(), picture.begin(), picture.end());
    return with({"render"}, more);
  };
  freevoxelDone(folder, render({"--formula", "raycast", "-o", "rays.exr"}));
  freevoxelDone(folder, render({"-o", "splats.exr"}));
  EXPECT_FALSE(hasGreen(readImage(folder + "/rays.exr")));
  EXPECT_FALSE(hasGreen(readImage(folder + "/splats.exr")));
  freevoxelDone(folder, with({"precompute"}, {"--transfer", "labels.json", "-o", "labels.fvx"}));
  const auto info = nlohmann::json::parse(freevoxelDone(folder, {"info", "--json", "labels.fvx"}).output);
  EXPECT_EQ(info["classification"], "voxel");
  freevoxelDone(folder, {"render", "labels.fvx", "--size", "60x50", "-o", "file.exr"});
  EXPECT_FALSE(hasGreen(readImage(folder + "/file.exr")));
  expectRefusal(folder, render({"--formula", "raycast", "--raycast", "post", "-o", "no.exr"}), kUsage,
                "--raycast post");
  expectRefusal(folder, render({"--footprint", "cell", "-o", "no.exr"}), kUsage, "--footprint cell");
  expectRefusal(
      folder, with({"precompute"}, {"--transfer", "labels.json", "--classification", "preintegrated", "-o", "no.fvx"}),
      kUsage, "labels do not allow");
}

TEST(Formats, transferFunctionsByNameAndSheets) {
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, {"generate", "sphere", "--dims", "20,16,12", "-o", "sphere.nrrd"});
  freevoxelDone(folder, {"transfer", "sphere.nrrd", "--transfer", "ct-bone", "-o", "bone.json"});
  freevoxelDone(folder, {"render", "sphere.nrrd", "--transfer", "ct-bone", "--size", "60x50", "-o", "name.png"});
  freevoxelDone(folder, {"render", "sphere.nrrd", "--transfer", "bone.json", "--size", "60x50", "-o", "file.png"});
  EXPECT_EQ(readImage(folder + "/name.png").pixels, readImage(folder + "/file.png").pixels);
  freevoxelDone(folder, {"render", "sphere.nrrd", "--transfer", "auto", "--size", "60x50", "-o", "auto.png"});
  freevoxelDone(folder, {"sheet", "name.png", "file.png", "auto.png", "--columns", "2", "--gap", "4", "-o", "all.png"});
  EXPECT_EQ(readImage(folder + "/all.png").size, glm::ivec2(124, 104));
  expectRefusal(folder, {"render", "sphere.nrrd", "--transfer", "ct-boan", "-o", "no.png"}, kFailed,
                "neither a file nor one of auto");
}

}  // namespace freevoxel::test
