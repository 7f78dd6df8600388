// The built freevoxel program, as a user calls it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/process.h"

namespace freevoxel::test {

/// Exit statuses: the input or the machine would not do; the command line was wrong.
constexpr int kFailed = 1, kUsage = 2;

std::string programPath();

/// Runs `freevoxel ARGUMENTS...` in `folder`.
ProcessResult freevoxel(const std::string& folder, const std::vector<std::string>& arguments);

/// The same by `rankCount` processes under mpirun; `otherCount` more, with the highest ranks, get other arguments.
ProcessResult mpirun(const std::string& folder, int rankCount, const std::vector<std::string>& arguments,
                     int otherCount = 0, const std::vector<std::string>& otherArguments = {});

/// As above; fails the test unless the exit status is 0.
ProcessResult freevoxelDone(const std::string& folder, const std::vector<std::string>& arguments);

/// As above; fails the test unless the exit status is `status`, stdout is empty and stderr is one line that starts with
/// "freevoxel: " and holds `expected`.
void expectRefusal(const std::string& folder, const std::vector<std::string>& arguments, int status,
                   const std::string& expected);

nlohmann::json readJson(const std::string& path);

/// The words of a line, without quoting.
std::vector<std::string> words(const std::string& line);

}  // namespace freevoxel::test
