#include "app/progress_bar.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace freevoxel {

namespace {

/// "12.3 M", three digits and a decimal prefix.
std::string withPrefix(double value) {
  constexpr std::string_view kPrefixes = " kMGT";
  size_t prefix = 0;
  for (; value >= 1000.0 && prefix + 1 < kPrefixes.size(); ++prefix)
    value /= 1000.0;
  return prefix == 0 ? fmt::format("{:.3g} ", value) : fmt::format("{:.3g} {}", value, kPrefixes[prefix]);
}

std::string duration(double seconds) {
  const auto whole = std::lround(seconds);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

}  // namespace

ProgressBar::ProgressBar(std::FILE* terminal, std::function<Clock::time_point()> now)
    : terminal_(terminal), now_(std::move(now)) {}

void ProgressBar::begin(const std::string& stage, uint64_t total, const std::string& unit) {
  end();
  stage_ = stage;
  unit_ = unit;
  total_ = total;
  done_ = 0;
  start_ = now_();
  draw(start_);
}

void ProgressBar::advance(uint64_t steps) {
  constexpr std::chrono::milliseconds kRedraw(100);
  done_ += steps;
  const Clock::time_point now = now_();
  if (now - lastDrawn_ >= kRedraw) draw(now);
}

void ProgressBar::draw(Clock::time_point now) {
  constexpr size_t kWidth = 24;
  lastDrawn_ = now;
  shown_ = true;
  const double share = total_ == 0 ? 1.0 : std::min(1.0, double(done_) / double(total_));
  const std::string bar(size_t(share * kWidth), '#');
  fmt::print(terminal_, "\r{} [{:<{}}] {:3.0f} %", stage_, bar, kWidth, 100.0 * share);
  if (done_ != 0 && now > start_) {
    const double rate = double(done_) / std::chrono::duration<double>(now - start_).count();
    const double left = double(total_ - std::min(done_, total_)) / rate;
    fmt::print(terminal_, "  {}{}/s  {} left", withPrefix(rate), unit_, duration(left));
  }
  // Erases what a longer line before may have left.
  fmt::print(terminal_, "\x1b[K");
  std::fflush(terminal_);
}

void ProgressBar::end() {
  if (!shown_) return;
  shown_ = false;
  fmt::print(terminal_, "\r\x1b[K");
  std::fflush(terminal_);
}

}  // namespace freevoxel
