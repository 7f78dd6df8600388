#include "app/session.h"

#include <fmt/core.h>
#include <omp.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <string_view>

#include "app/progress_bar.h"
#include "base/atomic_file.h"

namespace freevoxel {

namespace {

/// In single quotes if a shell would take it for anything but one plain word.
std::string quoted(std::string_view argument) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_=+,./:%@^";
  if (!argument.empty() && argument.find_first_not_of(kPlain) == std::string_view::npos) return std::string(argument);
  std::string text = "'";
  for (const char c : argument) {
    if (c == '\'') {
      text += "'\\''";
    } else {
      text += c;
    }
  }
  return text + "'";
}

bool onTerminal() {
  const char* terminal = getenv("TERM");
  return isatty(STDERR_FILENO) != 0 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

}  // namespace

uint64_t peakMemoryBytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return uint64_t(usage.ru_maxrss) * 1024;
}

std::string programVersion() {
  return "freevoxel " FREEVOXEL_VERSION;
}

std::string typedCommand(int argc, const char* const* argv) {
  std::string command = "freevoxel";
  for (int i = 1; i < argc; ++i)
    command += ' ' + quoted(argv[i]);
  return command;
}

Session::Session(std::string command, const CommonOptions& options, const Ranks& ranks, bool shared)
    : command_(std::move(command)), options_(options), ranks_(ranks), progress_(std::make_unique<Progress>()) {
  std::optional<int> threads = options.threads;
  if (!threads && shared && ranks.launched()) {
    const int fair = ranks.fairThreadCount();
    if (getenv("OMP_NUM_THREADS") == nullptr) threads = fair;
  }
  if (threads) {
    omp_set_num_threads(*threads);
    // Mesa's software renderer has threads of its own. What the user set himself stays.
    setenv("LP_NUM_THREADS", std::to_string(*threads).c_str(), 0);
  }
  if (!options.quiet && ranks.isRoot() && onTerminal()) progress_ = std::make_unique<ProgressBar>();
}

ImageMetadata Session::imageMetadata() const {
  return {{"Software", programVersion()}, {"Command", command_}};
}

void Session::warn(const std::string& text) {
  warnings_.push_back(text);
  tell("warning: " + text);
}

void Session::tell(const std::string& text) const {
  if (!options_.quiet) complain(text);
}

void Session::complain(const std::string& text) const {
  if (ranks_.isRoot()) fmt::print(stderr, "freevoxel: {}\n", text);
}

void Session::addSeconds(const std::string& stage, double seconds) {
  seconds_[stage] = seconds_.value(stage, 0.0) + seconds;
}

void Session::writeStatistics() {
  if (options_.statisticsPath.empty() || !ranks_.isRoot()) return;
  addSeconds("total", std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
  nlohmann::ordered_json all = {
      {"command", command_}, {"version", FREEVOXEL_VERSION}, {"seconds", seconds_}, {"threads", omp_get_max_threads()}};
  all.update(statistics);
  all["peakMemoryBytes"] = peakMemoryBytes();
  all["warnings"] = warnings_;
  const std::string text = all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n';
  AtomicFile file(options_.statisticsPath);
  file.writeAt(0, std::as_bytes(std::span(text)));
  file.commit();
}

}  // namespace freevoxel
