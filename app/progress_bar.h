// Progress on a terminal.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

#include "base/progress.h"

namespace freevoxel {

/// One line that rewrites itself: stage, share done, rate, time left. There from the beginning of a stage, gone when it
/// ends.
class ProgressBar : public Progress {
 public:
  using Clock = std::chrono::steady_clock;
  explicit ProgressBar(std::FILE* terminal = stderr, std::function<Clock::time_point()> now = Clock::now);
  ~ProgressBar() override { end(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void begin(const std::string& stage, uint64_t total, const std::string& unit) override;
  void advance(uint64_t steps) override;
  void end() override;

 private:
  void draw(Clock::time_point now);

  std::FILE* terminal_;
  std::function<Clock::time_point()> now_;
  std::string stage_, unit_;
  uint64_t total_ = 0, done_ = 0;
  Clock::time_point start_, lastDrawn_;
  bool shown_ = false;
};

}  // namespace freevoxel
