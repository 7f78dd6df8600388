// The bar: what it shows, and that it shows on a terminal and nowhere else.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "app/progress_bar.h"
#include "tests/app/program.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {
namespace {

const std::string kErased = "\r\x1b[K";

/// A bar that writes to memory, and the clock that it reads.
class WatchedBar {
 public:
  WatchedBar()
      : terminal_(open_memstream(&text_, &bytes_)),
        bar_(std::make_unique<ProgressBar>(terminal_, [this] { return now_; })) {}
  ~WatchedBar() {
    bar_.reset();
    std::fclose(terminal_);
    std::free(text_);
  }
  ProgressBar& bar() { return *bar_; }
  void wait(int milliseconds) { now_ += std::chrono::milliseconds(milliseconds); }
  /// What it has written since the last call.
  std::string written() {
    const std::string text = std::string(text_, bytes_).substr(seen_);
    seen_ = bytes_;
    return text;
  }

 private:
  char* text_ = nullptr;
  size_t bytes_ = 0, seen_ = 0;
  std::FILE* terminal_;
  ProgressBar::Clock::time_point now_;
  std::unique_ptr<ProgressBar> bar_;
};

TEST(ProgressBar, showsShareRateAndTimeLeft) {
  WatchedBar watched;
  ProgressBar& bar = watched.bar();
  bar.begin("attenuation", 1000000000, "voxels");
  EXPECT_EQ(watched.written(), "\rattenuation [                        ]   0 %\x1b[K");
  watched.wait(2000);
  bar.advance(250000000);
  EXPECT_EQ(watched.written(), "\rattenuation [######                  ]  25 %  125 Mvoxels/s  0:06 left\x1b[K");
  watched.wait(99);
  bar.advance(1);
  EXPECT_EQ(watched.written(), "") << "not more often than ten times a second";
  watched.wait(397901);
  bar.advance(249999999);
  EXPECT_EQ(watched.written(), "\rattenuation [############            ]  50 %  1.25 Mvoxels/s  6:40 left\x1b[K");
  watched.wait(100);
  bar.advance(600000000);
  EXPECT_EQ(watched.written(), "\rattenuation [########################] 100 %  2.75 Mvoxels/s  0:00 left\x1b[K")
      << "more steps than were told of";
  bar.begin("checksums", 10, "bricks");
  EXPECT_EQ(watched.written(), kErased + "\rchecksums [                        ]   0 %\x1b[K");
  bar.end();
  EXPECT_EQ(watched.written(), kErased);
  bar.end();
  EXPECT_EQ(watched.written(), "");
  bar.begin("nothing", 0, "bricks");
  EXPECT_EQ(watched.written(), "\rnothing [########################] 100 %\x1b[K");
}

TEST(ProgressBar, isThereOnATerminalOnly) {
  constexpr const char* kTerminal = "/usr/bin/script";
  if (access(kTerminal, X_OK) != 0) GTEST_SKIP() << "no " << kTerminal << " to make a terminal with";
  const std::string folder = temporaryFolder();
  freevoxelDone(folder, words("generate cloud --dims 20,15,10 -o a.nrrd"));
  writeBytes(folder + "/t.json", R"({"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0},
                                                                  {"value": 255, "color": [1, 1, 1], "opacity": 1}]})");
  const std::string call = "precompute a.nrrd --transfer t.json -o a.fvx --threads 1";
  EXPECT_EQ(freevoxelDone(folder, words(call)).talk, "");

  ProcessOptions options;
  options.folder = folder;
  options.environment = {{"TERM", "xterm"}};
  const ProcessResult result =
      runProcess({kTerminal, "-q", "-e", "-c", "'" + programPath() + "' " + call, "/dev/null"}, options);
  EXPECT_EQ(result.status, 0) << result.output << result.talk;
  EXPECT_NE(result.output.find("\rattenuation [                        ]   0 %\x1b[K"), std::string::npos)
      << result.output;
  EXPECT_TRUE(result.output.ends_with(kErased)) << "the bar is gone at the end: " << result.output;
}

}  // namespace
}  // namespace freevoxel::test
