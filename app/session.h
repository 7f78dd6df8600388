// What one run of the program knows: how it was called, whom it tells, what it did.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/options.h"
#include "base/image.h"
#include "base/progress.h"
#include "parallel/ranks.h"

namespace freevoxel {

/// The program's name and version, "freevoxel 0.1.0".
std::string programVersion();

/// The arguments as they would be typed into a shell, the program's path shortened to its name.
std::string typedCommand(int argc, const char* const* argv);

/// Largest resident memory of this process so far.
uint64_t peakMemoryBytes();

class Session {
 public:
  /// Collective if `shared`: whether all ranks run this command. `options` and `ranks` must outlive the session.
  Session(std::string command, const CommonOptions& options, const Ranks& ranks, bool shared);

  const std::string& command() const { return command_; }
  /// The processes that run this command. Only rank 0 speaks and writes.
  const Ranks& ranks() const { return ranks_; }
  Progress& progress() { return *progress_; }
  ImageMetadata imageMetadata() const;

  /// Shown on stderr unless --quiet, and kept for the statistics.
  void warn(const std::string& text);
  /// Shown on stderr unless --quiet.
  void tell(const std::string& text) const;
  /// Shown on stderr: why the run fails.
  void complain(const std::string& text) const;

  /// Calls f and adds the time it took to statistics "seconds" under `stage`.
  template <class F>
  decltype(auto) timed(const std::string& stage, F&& f) {
    const StageTimer timer{*this, stage, std::chrono::steady_clock::now()};
    return f();
  }
  void addSeconds(const std::string& stage, double seconds);

  /// Entries of the statistics file.
  nlohmann::ordered_json statistics = nlohmann::ordered_json::object();

  /// Writes the statistics file if one was asked for, on rank 0. Throws MachineError.
  void writeStatistics();

 private:
  struct StageTimer {
    Session& session;
    const std::string& stage;
    std::chrono::steady_clock::time_point start;
    ~StageTimer() {
      session.addSeconds(stage, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  };

  std::string command_;
  const CommonOptions& options_;
  const Ranks& ranks_;
  std::unique_ptr<Progress> progress_;
  std::vector<std::string> warnings_;
  nlohmann::ordered_json seconds_ = nlohmann::ordered_json::object();
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace freevoxel
