// --memory is a bound that the system may enforce.
#include <gtest/gtest.h>

#include <filesystem>

#include "base/address_sanitizer.h"
#include "base/compare.h"
#include "base/image.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

constexpr uint64_t kMebibyte = uint64_t(1) << 20;

class Memory : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kUnderAddressSanitizer) GTEST_SKIP() << "the address sanitizer's own memory is beyond any limit";
    writeBytes(folder + "/t.json", R"({"range": [0, 255], "points": [
      {"value": 90, "color": [0.2, 0.5, 1], "opacity": 0}, {"value": 255, "color": [1, 0.8, 0.5], "opacity": 0.6}]})");
  }
  /// `call` in a process that can claim no more than that.
  ProcessResult within(uint64_t bytes, const std::string& call) const {
    std::vector<std::string> all = {programPath()};
    for (const std::string& word : words(call))
      all.push_back(word);
    ProcessOptions options;
    options.folder = folder;
    options.dataBytes = bytes;
    return runProcess(all, options);
  }
  void run(const std::string& call) const { freevoxelDone(folder, words(call)); }

  const std::string folder = temporaryFolder();
};

TEST_F(Memory, boundsAPrecompute) {
  run("generate cloud --dims 220,200,190 -o a.nrrd");
  for (const std::string layout : {"dense", "compact"}) {
    const std::string call = "precompute a.nrrd --transfer t.json -o a.fvx --quiet --threads 2 --layout " + layout;
    const ProcessResult bounded = within(80 * kMebibyte, call + " --memory 80M");
    EXPECT_EQ(bounded.status, 0) << layout << ": " << bounded.talk;
    run("verify a.fvx");
    std::filesystem::remove(folder + "/a.fvx");
  }
  // Without the option more is wanted, so the limit was one.
  const ProcessResult unbounded =
      within(80 * kMebibyte, "precompute a.nrrd --transfer t.json -o a.fvx --quiet --threads 2 --layout compact");
  EXPECT_EQ(unbounded.status, kFailed);
  EXPECT_NE(unbounded.talk.find("try --memory"), std::string::npos) << unbounded.talk;
  EXPECT_FALSE(std::filesystem::exists(folder + "/a.fvx"));
}

TEST_F(Memory, boundsAPicture) {
  run("generate cloud --dims 220,200,190 -o a.nrrd");
  run("precompute a.nrrd --transfer t.json --layout compact -o a.fvx");
  const std::string call =
      "render a.fvx --attenuation interpolated --backend cpu --size 300x400 --threads 2 --quiet --sums sums.exr -o ";
  run(call + "any.exr");
  const ProcessResult bounded = within(224 * kMebibyte, call + "bounded.exr --memory 224M");
  EXPECT_EQ(bounded.status, 0) << bounded.talk;
  EXPECT_TRUE(compareImages(readImage(folder + "/any.exr"), readImage(folder + "/bounded.exr")).identical);
  // Less than the program needs for itself: told before anything is drawn.
  const ProcessResult small = within(100 * kMebibyte, call + "small.exr --memory 100M");
  EXPECT_EQ(small.status, kFailed);
  EXPECT_NE(small.talk.find("allow more"), std::string::npos) << small.talk;
  EXPECT_FALSE(std::filesystem::exists(folder + "/small.exr"));
}

}  // namespace
}  // namespace freevoxel::test
