// Runs a program and catches what it says.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace freevoxel::test {

struct ProcessResult {
  int status = 0;      ///< exit status, or 128 + signal
  std::string output;  ///< stdout
  std::string talk;    ///< stderr
};

struct ProcessOptions {
  std::string folder;                                            ///< working folder; empty = the test's own
  std::vector<std::pair<std::string, std::string>> environment;  ///< added to the test's own
  uint64_t dataBytes = 0;                                        ///< the most private memory (RLIMIT_DATA); 0: any
  int signal = 0;                                                ///< sent once to the process ...
  double signalAfter = 0.0;                                      ///< ... after this many seconds
};

/// Runs `arguments` (the first is the program's path) with stdin empty, to its end.
ProcessResult runProcess(const std::vector<std::string>& arguments, const ProcessOptions& options = {});

}  // namespace freevoxel::test
