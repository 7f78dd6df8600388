// Several processes under mpirun: the same bits, and one clear line if one of them fails.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "base/compare.h"
#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

const char* const kTransfer = R"({"range": [0, 255], "points": [
  {"value": 0, "color": [0.1, 0.2, 0.9], "opacity": 0.0},
  {"value": 90, "color": [0.9, 0.5, 0.1], "opacity": 0.05},
  {"value": 255, "color": [1.0, 1.0, 0.9], "opacity": 0.6}]})";

/// Lines that the program wrote, the launcher's own left out.
std::vector<std::string> ownLines(const std::string& talk) {
  std::vector<std::string> lines;
  std::istringstream stream(talk);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("freevoxel: ")) lines.push_back(line);
  }
  return lines;
}

/// A folder with cloud.fvx, 3 x 2 x 2 blocks.
class RanksOfProgram : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = temporaryFolder();
    writeBytes(folder + "/t.json", kTransfer);
    makeCloud("cloud", 7);
  }
  static void makeCloud(const std::string& name, int seed) {
    run("generate checkered-cloud --dims 70,45,37 --spacing 0.8,1.1,1.3 --seed " + std::to_string(seed) + " -o " +
        name + ".nrrd");
    run("precompute " + name + ".nrrd --transfer t.json -o " + name + ".fvx");
  }
  static void run(const std::string& call) { freevoxelDone(folder, words(call)); }
  static void runRanks(int rankCount, const std::string& call) {
    const ProcessResult result = mpirun(folder, rankCount, words(call));
    EXPECT_EQ(result.status, 0) << call << "\n" << result.talk;
    EXPECT_TRUE(ownLines(result.talk).empty()) << result.talk;
  }
  static void expectIdentical(const std::string& a, const std::string& b) {
    EXPECT_TRUE(compareImages(readImage(folder + "/" + a), readImage(folder + "/" + b)).identical) << a << " " << b;
  }
  /// The run failed with one line of its own that holds `expected`, and left nothing.
  static void expectFailure(const ProcessResult& result, const std::string& expected) {
    EXPECT_NE(result.status, 0);
    EXPECT_EQ(result.output, "");
    const std::vector<std::string> lines = ownLines(result.talk);
    ASSERT_EQ(lines.size(), 1u) << result.talk;
    EXPECT_NE(lines[0].find(expected), std::string::npos) << lines[0];
    for (const std::string& name : listFolder(folder))
      EXPECT_EQ(name.find("no."), std::string::npos) << name;
  }

  static inline std::string folder;
};

constexpr const char* kView = " --size 61x43 --orbit 35,25 ";

/// More ranks than slabs of bricks among them.
TEST_F(RanksOfProgram, PrecomputeTheSameBytes) {
  for (const std::string options : {"--layout dense --classification voxel --brick 8", "--layout compact --brick 8",
                                    "--layout compact --classification voxel", "--layout dense"}) {
    // The command stands in the file.
    const std::string call = "precompute cloud.nrrd --transfer t.json -o shared.fvx " + options;
    run(call);
    const std::string expected = readBytes(folder + "/shared.fvx");
    for (const int rankCount : {2, 3, 5, 8}) {
      std::filesystem::remove(folder + "/shared.fvx");
      runRanks(rankCount, call);
      EXPECT_EQ(readBytes(folder + "/shared.fvx"), expected) << rankCount << ' ' << options;
    }
  }
}

TEST_F(RanksOfProgram, LeaveNoFileIfOneFailsToPrecompute) {
  const std::string call = "precompute cloud.nrrd --transfer t.json -o no.fvx";
  expectFailure(mpirun(folder, 2, words(call), 1, words("precompute none.nrrd --transfer t.json -o no.fvx")),
                "rank 2: none.nrrd");
  expectFailure(mpirun(folder, 2, words("precompute cloud.nrrd --transfer t.json -o none/no.fvx")),
                "rank 0: none/no.fvx");
  expectFailure(mpirun(folder, 2, words("precompute cloud.nrrd --transfer auto -o no.fvx")),
                "needs them all in memory");
}

TEST_F(RanksOfProgram, DrawTheSameBits) {
  const std::string plain = std::string("render cloud.fvx") + kView;
  const std::string lit =
      plain + "--light 100,90,80 --light-direction 0,1,0.2,1,0.5,0.2 --shading phong --footprint kernel ";
  run(plain + "-o one.exr --sums one_sums.exr");
  run(lit + "-o lit.exr --sums lit_sums.exr");
  runRanks(2, plain + "-o two.exr --sums two_sums.exr --stats two.json");
  expectIdentical("one_sums.exr", "two_sums.exr");
  expectIdentical("one.exr", "two.exr");
  runRanks(3, plain + "-o three.exr --sums three_sums.exr --partition hilbert --threads 2 --backend gl");
  expectIdentical("one_sums.exr", "three_sums.exr");
  runRanks(5, lit + "-o five.exr --sums five_sums.exr --partition random:1 --composite reduce");
  expectIdentical("lit_sums.exr", "five_sums.exr");

  const nlohmann::json two = readJson(folder + "/two.json");
  ASSERT_EQ(two["ranks"].size(), 2u);
  EXPECT_EQ(two["ranks"][0]["blocks"].get<int>() + two["ranks"][1]["blocks"].get<int>(), two["blocks"].get<int>());
  EXPECT_GT(two["ranks"][1]["blocks"], 0);
  EXPECT_GT(two["ranks"][1]["sentBytes"], 0);
  EXPECT_GT(two["ranks"][1]["peakMemoryBytes"], 0);
  EXPECT_GT(two["ranks"][1]["volumeBytes"], 0);
  EXPECT_EQ(two["partition"], "round-robin");
}

// By bands of rows, of a volume and of a scene with a mirror; five ranks have rows of different number.
TEST_F(RanksOfProgram, TraceTheSameBits) {
  const std::string volume = "trace cloud.nrrd --transfer t.json --size 37x23 --light-direction 1,1,0.3 ";
  writeBytes(folder + "/balls.csv", "x,y,z,radius\n0,0,0,1\n1.5,0.4,0.2,0.7\n0.3,1.6,-0.4,0.6\n");
  writeBytes(
      folder + "/balls.json",
      R"({"spheres": [{"file": "balls.csv", "material": "chrome"}], "materials": {"chrome": {"kind": "mirror"}}})");
  const std::string scene = "trace balls.json --resolution 24 --size 31x18 --light-direction 1,1,0.3 ";
  for (const bool ofVolume : {true, false}) {
    const std::string& call = ofVolume ? volume : scene;
    run(call + "-o alone.exr --backend cpu --stats alone.json");
    const nlohmann::json alone = readJson(folder + "/alone.json");
    const int ranks = ofVolume ? 2 : 5;
    runRanks(ranks, call + "-o bands.exr --backend cpu --stats bands.json");
    expectIdentical("alone.exr", "bands.exr");
    const nlohmann::json bands = readJson(folder + "/bands.json");
    ASSERT_EQ(bands["ranks"].size(), size_t(ranks));
    int rows = 0;
    for (const nlohmann::json& rank : bands["ranks"])
      rows += rank["rows"].get<int>();
    EXPECT_EQ(rows, ofVolume ? 23 : 18);
    EXPECT_EQ(bands.value("rays", 0), alone.value("rays", 0));
    run(call + "-o alone.exr --backend gl");
    runRanks(2, call + "-o bands.exr --backend gl");
    expectIdentical("alone.exr", "bands.exr");
  }
  expectFailure(mpirun(folder, 2, words("trace no.ply -o no.png")), "no.ply");
}

// With interpolated attenuation a rank reads the bricks of its own blocks, and what touches them.
TEST_F(RanksOfProgram, ReadWhatTheyDraw) {
  run("generate checkered-cloud --dims 200,20,24 -o long.nrrd");
  run("precompute long.nrrd --transfer t.json --layout compact -o long.fvx");
  const std::string call = std::string("render long.fvx --attenuation interpolated --size 61x43 --orbit 35,25 ");
  run(call + "-o alone.exr --sums alone_sums.exr --stats alone.json");
  // Seven blocks in a row: four of them, and three.
  runRanks(2, call + "-o each.exr --sums each_sums.exr --stats each.json --partition hilbert");
  expectIdentical("alone_sums.exr", "each_sums.exr");
  const double all = readJson(folder + "/alone.json")["volumeBytes"];
  EXPECT_GT(all, 200.0 * 20.0 * 24.0);
  for (const nlohmann::json& rank : readJson(folder + "/each.json")["ranks"])
    EXPECT_LT(rank["volumeBytes"], 0.75 * all);
}

TEST_F(RanksOfProgram, TurnTogether) {
  const std::string turn = std::string("render cloud.nrrd --transfer t.json --frames 3") + kView;
  run(turn + "-o turn.exr --sums sums.exr");
  run(std::string("render cloud.nrrd --transfer t.json") + kView + "-o first.exr");
  expectIdentical("turn_0000.exr", "first.exr");
  EXPECT_FALSE(compareImages(readImage(folder + "/turn_0001.exr"), readImage(folder + "/turn_0002.exr")).identical);
  runRanks(2, turn + "-o shared.exr --sums shared_sums.exr");
  for (const std::string frame : {"0000", "0001", "0002"}) {
    expectIdentical("turn_" + frame + ".exr", "shared_" + frame + ".exr");
    expectIdentical("sums_" + frame + ".exr", "shared_sums_" + frame + ".exr");
  }
  EXPECT_FALSE(std::filesystem::exists(folder + "/turn.exr"));
}

// Every rank's matter in its own colour, as dense as it is.
TEST_F(RanksOfProgram, ShowWhoDrewWhat) {
  const std::string call = std::string("render cloud.fvx --formula direct") + kView;
  run(call + "-o plain.exr --sums plain_sums.exr");
  runRanks(2, call + "--colour-by rank -o by_rank.exr --sums by_rank_sums.exr");
  const Image plain = readImage(folder + "/plain_sums.exr"), byRank = readImage(folder + "/by_rank_sums.exr");
  bool more[2] = {false, false};  // of red than of green, and the reverse
  for (size_t i = 0; i < plain.pixels.size(); i += 6) {
    for (size_t c = 3; c < 6; ++c)
      ASSERT_EQ(plain.pixels[i + c], byRank.pixels[i + c]);
    for (size_t c = 0; c < 3; ++c)
      ASSERT_LE(byRank.pixels[i + c], byRank.pixels[i + 3] + 0x1p-18f);
    more[0] = more[0] || byRank.pixels[i] > 1.2f * byRank.pixels[i + 1];
    more[1] = more[1] || byRank.pixels[i + 2] > 1.2f * byRank.pixels[i];
  }
  EXPECT_TRUE(more[0] && more[1]);
}

TEST_F(RanksOfProgram, OneFailsAllEnd) {
  const std::string good = std::string("render cloud.fvx -o no.png") + kView;
  makeCloud("other", 8);
  expectFailure(mpirun(folder, 3, words("render none.fvx -o no.png")), "rank 0: none.fvx: cannot open");
  expectFailure(mpirun(folder, 2, words(good), 1, words("render none.fvx -o no.png")), "rank 2: none.fvx: cannot open");
  expectFailure(mpirun(folder, 1, words(good), 1, words(std::string("render other.fvx -o no.png") + kView)),
                "cloud.fvx: rank 1 sees another file than rank 0");
  writeBytes(folder + "/map", "0 1 2");
  expectFailure(mpirun(folder, 2, words(good + " --partition file:map")), "map: ");
  expectFailure(mpirun(folder, 2, words("render cloud.fvx -o none/no.png")), "rank 0: none/no.png");
}

TEST_F(RanksOfProgram, UsageIsToldOnce) {
  ProcessResult result = mpirun(folder, 2, words("render cloud.fvx -o no.png --partition some"));
  expectFailure(result, "expected round-robin, hilbert, slab, random:SEED or file:F, found 'some'");
  EXPECT_EQ(result.status, kUsage);
  result = mpirun(folder, 2, words("render cloud.fvx -o no.png --formula blended"));
  expectFailure(result, "without the launcher");
  EXPECT_EQ(result.status, kUsage);
}

TEST_F(RanksOfProgram, SpeedupOfVirtualAndRealRanks) {
  const std::string call = std::string("speedup cloud.fvx --json --threads 1 --partition round-robin,random:3") + kView;
  const nlohmann::json all = nlohmann::json::parse(
      freevoxelDone(folder, words(call + "--ranks 1,2,5 --block 16,32 --views 2 --plot p.png --plot p.svg")).output);
  EXPECT_FALSE(all["real"]);
  ASSERT_EQ(all["rows"].size(), 12u);
  for (const nlohmann::json& row : all["rows"]) {
    for (const char* key : {"balance", "worstBalance", "balancePieces", "worstBalancePieces"}) {
      EXPECT_GT(row[key], 0.0) << key;
      EXPECT_LE(row[key], 1.0 + 1e-12) << key;
    }
    EXPECT_GT(row["speedup"], 0.0);
    EXPECT_DOUBLE_EQ(row["efficiency"].get<double>() * row["ranks"].get<double>(), row["speedup"].get<double>());
    EXPECT_LE(row["speedupWithComposite"], row["speedup"]);
    if (row["ranks"] == 1) {
      EXPECT_DOUBLE_EQ(row["balance"], 1.0);
      EXPECT_EQ(row["sentBytes"], 0.0);
    }
  }
  EXPECT_EQ(readBytes(folder + "/p.png").substr(1, 3), "PNG");
  EXPECT_NE(readBytes(folder + "/p.svg").find("<svg"), std::string::npos);

  const nlohmann::json counted = nlohmann::json::parse(freevoxelDone(folder, words(call + "--ranks 5 --count")).output);
  EXPECT_DOUBLE_EQ(counted["rows"][0]["balance"], all["rows"][8]["balance"]);

  const ProcessResult real = mpirun(folder, 2, words(call));
  EXPECT_EQ(real.status, 0) << real.talk;
  const nlohmann::json rows = nlohmann::json::parse(real.output);
  EXPECT_TRUE(rows["real"]);
  ASSERT_EQ(rows["rows"].size(), 2u);
  EXPECT_EQ(rows["rows"][0]["ranks"], 2);
  EXPECT_GT(rows["rows"][0]["sentBytes"], 0);
}

TEST_F(RanksOfProgram, OtherCommandsRunOnce) {
  const ProcessResult one = freevoxel(folder, {"info", "cloud.fvx"});
  const ProcessResult two = mpirun(folder, 2, {"info", "cloud.fvx"});
  EXPECT_EQ(two.status, 0) << two.talk;
  EXPECT_EQ(two.output, one.output);
  EXPECT_EQ(mpirun(folder, 2, {"--version"}).output, freevoxel(folder, {"--version"}).output);
}

}  // namespace
}  // namespace freevoxel::test
