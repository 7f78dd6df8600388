// Scenes of meshes and spheres, through the real program.
#include <gtest/gtest.h>

#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

/// A square of edge 2 about the origin, in the plane z = 0, and one vertex that is no number.
const char* const kSquare =
    "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement face "
    "3\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0\n1 -1 0\n1 1 0\n-1 1 0\nnan 0 0\n4 0 1 2 3\n3 0 1 "
    "4\n3 0 1 1\n";

/// A roof whose ridge is the y axis, 0.6 above its edges.
const char* const kRoof =
    "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face "
    "2\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0\n0 -1 0.6\n1 -1 0\n-1 1 0\n0 1 0.6\n1 1 0\n"
    "4 0 1 4 3\n4 1 2 5 4\n";

class Objects : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = temporaryFolder();
    writeBytes(folder + "/square.ply", kSquare);
    writeBytes(folder + "/roof.ply", kRoof);
    writeBytes(folder + "/atoms.xyz", "2\n\nO 0 0 0\nC 0 0 9\n");
  }
  /// Looks along -z at 10 x 10 lengths about the origin.
  static void writeScene(const std::string& objects) {
    writeBytes(folder + "/scene.json",
               "{" + objects +
                   ",\n\"camera\": {\"eye\": [0, 0, 20], \"target\": [0, 0, 0], \"orthographic\": 10},\n"
                   "\"image\": {\"size\": [50, 40], \"background\": \"transparent\"}}\n");
  }
  static Image trace(const std::string& objects, const std::string& options = "") {
    writeScene(objects);
    freevoxelDone(folder, words("trace scene.json --backend cpu --resolution 64 -o a.exr --stats s.json " + options));
    return readImage(folder + "/a.exr");
  }
  static void expectPixel(const Image& image, int x, int y, float red, float green, float blue, float alpha) {
    const float* pixel = image.at(x, y);
    EXPECT_NEAR(pixel[0], red, 0.01f) << x << " " << y;
    EXPECT_NEAR(pixel[1], green, 0.01f) << x << " " << y;
    EXPECT_NEAR(pixel[2], blue, 0.01f) << x << " " << y;
    EXPECT_NEAR(pixel[3], alpha, 0.01f) << x << " " << y;
  }
  static void expectWrong(const std::string& objects, const std::string& expected) {
    writeScene(objects);
    expectRefusal(folder, words("trace scene.json -o wrong.png --backend cpu"), 1, expected);
  }

  static inline std::string folder;
};

TEST_F(Objects, areWhereTheSceneSaysInItsColours) {
  // Of 4 pixels a length: a red square of 4 x 4 lengths up and to the right, half opaque; a blue sphere at the left.
  const Image image = trace(
      "\"meshes\": [{\"file\": \"square.ply\", \"material\": \"red\", \"scale\": 2, \"translate\": [3, 2, -1]}],\n"
      "\"spheres\": [{\"center\": [-3, 0, 0], \"radius\": 1.5, \"material\": \"blue\"}],\n"
      "\"materials\": {\"red\": {\"color\": [1, 0, 0], \"opacity\": 0.5}, \"blue\": {\"color\": [0, 0, 1]}}");
  expectPixel(image, 37, 12, 0.5f, 0, 0, 0.5f);
  expectPixel(image, 31, 6, 0.5f, 0, 0, 0.5f);
  expectPixel(image, 37, 30, 0, 0, 0, 0);
  expectPixel(image, 13, 20, 0, 0, 1, 1);
  expectPixel(image, 13, 28, 0, 0, 0, 0);
  const auto statistics = readJson(folder + "/s.json");
  EXPECT_EQ(statistics["nonFiniteVertices"], 1);
  EXPECT_EQ(statistics["nonFiniteTriangles"], 1);
  EXPECT_EQ(statistics["degenerateTriangles"], 1);
  EXPECT_EQ(statistics["warnings"].size(), 3u);
  EXPECT_GT(statistics["rays"].get<int>(), 0);
}

TEST_F(Objects, turnAboutXThenYThenZ) {
  const auto turned = [&](const std::string& angles) {
    return trace("\"meshes\": [{\"file\": \"square.ply\", \"scale\": 4, \"rotate\": " + angles + "}]");
  };
  // Half an edge is 16 pixels.
  const Image upright = turned("[0, 0, 0]"), aslant = turned("[0, 0, 45]");
  expectPixel(upright, 39, 6, 0.8f, 0.8f, 0.8f, 1);
  expectPixel(upright, 25, 1, 0, 0, 0, 0);
  expectPixel(aslant, 39, 6, 0, 0, 0, 0);
  expectPixel(aslant, 25, 1, 0.8f, 0.8f, 0.8f, 1);
  // Its corner (1, 1) goes to (1.25, 0.5); about y first it would go to (0.5, 1.25).
  const Image both = turned("[60, 60, 0]");
  EXPECT_NEAR(both.at(42, 13)[3], 1.0f, 0.01f);
  EXPECT_EQ(both.at(32, 3)[3], 0.0f);
}

// Flat, the right half is as bright everywhere; smooth, the ridge looks up, past the lamp at the right. The first mesh
// of a scene, too.
TEST_F(Objects, haveSmoothNormalsWhereTheSceneSaysSo) {
  const auto roof = [](const char* more) {
    return trace("\"meshes\": [{\"file\": \"roof.ply\", \"scale\": 4" + std::string(more) +
                 "}], \"ambient\": 0, \"shading\": \"lambert\",\n\"lights\": [{\"direction\": [1, 0, 0]}]");
  };
  const Image flat = roof(""), smooth = roof(", \"smooth\": true");
  const float bright = flat.at(38, 20)[0];
  EXPECT_GT(bright, 0.3f);
  EXPECT_NEAR(flat.at(28, 20)[0], bright, 0.01f);
  EXPECT_LT(smooth.at(28, 20)[0], 0.5f * bright);
  EXPECT_GT(smooth.at(38, 20)[0], 0.8f * bright);
}

TEST_F(Objects, ofAFileAlone) {
  freevoxelDone(folder, words("trace square.ply --backend cpu --resolution 32 --size 31x23 --orbit 0,0 -o a.exr"));
  EXPECT_GT(readImage(folder + "/a.exr").at(15, 11)[3], 0.99f);
  freevoxelDone(folder, words("trace atoms.xyz --backend cpu --resolution 32 --size 31x23 --orbit 0,0 -o a.exr"));
  EXPECT_GT(readImage(folder + "/a.exr").at(15, 11)[3], 0.99f);
  freevoxelDone(folder, words("info square.ply --json"));
}

TEST_F(Objects, areCheckedWithTheLine) {
  expectWrong("\"meshes\": [{\"file\": \"square.ply\", \"scale\": 0}]",
              "line 1: meshes[0].scale: expected a number in");
  expectWrong("\"meshes\": [{\"file\": \"absent.ply\"}]", "absent.ply");
  expectWrong("\"spheres\": [{\"center\": [0, 0, 0]}]", "line 1: spheres[0]: expected a key 'radius'");
  expectWrong("\"spheres\": [{\"radius\": 1}]", "expected either 'file' or 'center'");
  expectWrong("\"spheres\": [{\"file\": \"atoms.xyz\"}],\n\"materials\": {\"Fe\": {\"kind\": \"mirror\"}}",
              "line 2: materials.Fe: no object has a material of this name (there are: C, O)");
  expectWrong("\"spheres\": [{\"file\": \"atoms.xyz\"}],\n\"materials\": {\"O\": {\"kind\": \"wood\"}}",
              "line 2: materials.O.kind: expected one of diffuse, mirror, glass, found 'wood'");
  expectWrong("\"materials\": {}", "expected a key 'volume'");
  writeScene("\"meshes\": [{\"file\": \"square.ply\"}]");
  expectRefusal(folder, words("render scene.json -o wrong.png"), 1, "only freevoxel trace shows these");
  expectRefusal(folder, words("trace square.ply --transfer t.json -o wrong.png"), 2, "--transfer");
}

}  // namespace
}  // namespace freevoxel::test
