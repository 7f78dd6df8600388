// Real volumes through the whole line, each with the transfer function that shows what it is known for.
#include <gtest/gtest.h>

#include "base/compare.h"
#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

struct DataSet {
  std::string name;      ///< of the test
  std::string file;      ///< in volumes/
  std::string options;   ///< what a raw file does not say
  std::string transfer;  ///< in examples/transfer/
  std::vector<int> dims;
  double minPsnr;  ///< dB against the pre-classified ray caster; what kernels reach on such data, less one or two
};

const DataSet kDataSets[] = {
    {"embryo", "embryo_256x256x256_uint8.raw.gz", "--dims 256,256,256 --type u8", "embryo.json", {256, 256, 256}, 32.0},
    {"cthead",
     "cthead_256x256x113_uint16_be.raw.gz",
     "--dims 256,256,113 --type u16 --endian big --spacing 1,1,2",
     "cthead.json",
     {256, 256, 113},
     24.0},
    {"aneurism",
     "aneurism_256x256x256_uint8.raw.gz",
     "--dims 256,256,256 --type u8",
     "aneurism.json",
     {256, 256, 256},
     25.0},
    {"stent", "stent.nrrd", "", "stent.json", {128, 128, 256}, 28.0},
    {"headsq", "headsq/quarter.nhdr", "", "headsq.json", {64, 64, 93}, 21.0},
    {"nucleon", "nucleon/nucleon.nrrd", "", "nucleon.json", {41, 41, 41}, 42.0},
};

void PrintTo(const DataSet& data, std::ostream* stream) {
  *stream << data.name;
}

class RealData : public ::testing::TestWithParam<DataSet> {
 protected:
  void SetUp() override {
    if (!dataFolder()) GTEST_SKIP() << kNoData;
    folder = temporaryFolder();
    volume = *dataFolder() + "/volumes/" + GetParam().file + " " + GetParam().options;
    transfer = sourceFolder() + "/examples/transfer/" + GetParam().transfer;
  }

  ProcessResult run(const std::string& call) const { return freevoxelDone(folder, words(call)); }
  Image image(const std::string& name) const { return readImage(folder + "/" + name); }

  std::string folder, volume, transfer;
};

TEST_P(RealData, becomesAPictureInAnyOrder) {
  const auto info = nlohmann::json::parse(run("info --json " + volume).output);
  EXPECT_EQ(info["dims"], GetParam().dims);
  run("precompute " + volume + " --transfer " + transfer + " --classification voxel -o data.fvx");
  run("verify data.fvx");

  const std::string view = "render data.fvx --size 500x400 --orbit 40,25 ";
  const std::string render = view + "--footprint kernel ";
  run(view + "--backend cpu -o cells.exr --sums cell_sums.exr");
  run(view + "--backend gl --order shuffle:3 -o gl_cells.exr --sums gl_cell_sums.exr");
  EXPECT_TRUE(compareImages(image("gl_cell_sums.exr"), image("cell_sums.exr")).identical);
  run(render + "--backend cpu -o picture.exr --sums sums.exr");
  const Image sums = image("sums.exr");
  const Image picture = image("picture.exr");
  for (const std::string how :
       {"--backend cpu --order reverse --threads 1", "--backend cpu --order shuffle:1 --threads 2",
        "--backend gl --order hilbert --threads 2", "--backend gl --order shuffle:2 --threads 3"}) {
    run(render + how + " -o other.exr --sums other_sums.exr");
    EXPECT_TRUE(compareImages(image("other_sums.exr"), sums).identical) << how;
    EXPECT_TRUE(compareImages(image("other.exr"), picture).identical) << how;
  }

  run(view + "--formula raycast --raycast pre --step 0.25 -o reference.exr");
  const ImageDifference difference = compareImages(picture, image("reference.exr"));
  EXPECT_GT(difference.coveredPixels, 5000u);
  EXPECT_GE(difference.psnr, GetParam().minPsnr);
  RecordProperty("psnr", std::to_string(difference.psnr));
}

INSTANTIATE_TEST_SUITE_P(DataSets, RealData, ::testing::ValuesIn(kDataSets),
                         [](const auto& testInfo) { return testInfo.param.name; });

// The scenes of examples/scenes, traced on the GPU (or what stands in for it) and by plain C++. As in
// SceneTracers.AgreeOnEverythingTogether, pixels whose rays graze an edge may differ, and glass carries that on.
class ExampleScenes : public ::testing::TestWithParam<const char*> {};

TEST_P(ExampleScenes, lookAlikeOnBothBackends) {
  if (!dataFolder()) GTEST_SKIP() << kNoData;
  const std::string folder = temporaryFolder();
  // Software renderers bind 128 MiB as one buffer; the capsid has 677,040 atoms.
  const std::string resolution = GetParam() == std::string("capsid") ? "64" : "128";
  for (const char* backend : {"gl", "cpu"}) {
    freevoxelDone(folder, words("trace " + sourceFolder() + "/examples/scenes/" + GetParam() + ".json --resolution " +
                                resolution + " --size 161x120 -o " + backend + ".exr --backend " + backend));
  }
  const Image found = readImage(folder + "/gl.exr"), expected = readImage(folder + "/cpu.exr");
  size_t covered = 0, flipped = 0;
  double sum = 0.0;
  for (size_t i = 0; i < found.pixels.size(); i += 4) {
    covered += expected.pixels[i + 3] > 0.0f || found.pixels[i + 3] > 0.0f ? 1 : 0;
    float most = 0.0f, mean = 0.0f;
    for (size_t channel = 0; channel < 4; ++channel) {
      const float difference = found.pixels[i + channel] - expected.pixels[i + channel];
      most = std::max(most, std::abs(difference));
      mean += difference / 4.0f;
    }
    if (most <= 0.01f) continue;
    ++flipped;
    sum += double(mean);
  }
  std::printf("%s: %zu of %zu pixels flipped, mean %g\n", GetParam(), flipped, covered, sum / double(covered));
  EXPECT_GT(covered, 1000u);
  EXPECT_LE(double(flipped), 0.03 * double(covered));
  EXPECT_LE(std::abs(sum) / double(covered), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(All, ExampleScenes,
                         ::testing::Values("glass_house", "glass_bunny", "dragon", "halo", "capsid", "tea",
                                           "two_heads"));

}  // namespace
}  // namespace freevoxel::test
