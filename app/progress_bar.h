// Progress on a terminal.
#pragma once

#include <chrono>
#include <string>

#include "base/progress.h"

namespace freevoxel {

/// One line on stderr that rewrites itself: stage, share done, rate, time left. Gone when the stage ends.
class ProgressBar : public Progress {
 public:
  ~ProgressBar() override { end(); }
  void begin(const std::string& stage, uint64_t total, const std::string& unit) override;
  void advance(uint64_t steps) override;
  void end() override;

 private:
  using Clock = std::chrono::steady_clock;
  void draw(Clock::time_point now);

  std::string stage_, unit_;
  uint64_t total_ = 0, done_ = 0;
  Clock::time_point start_, lastDrawn_;
  bool shown_ = false;
};

}  // namespace freevoxel
