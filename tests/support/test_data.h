// Where tests find their data and leave their files.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"

namespace freevoxel::test {

/// Folder of the real data sets: the environment's FREEVOXEL_DATA, else shared/data beside the checkout. Nothing if
/// neither exists; such tests are skipped: `if (!dataFolder()) GTEST_SKIP() << kNoData;`
std::optional<std::string> dataFolder();
inline constexpr const char* kNoData = "no real data: set FREEVOXEL_DATA to a copy of the data folder";

/// Top of the source tree, for examples/ and docs/.
std::string sourceFolder();

/// A fresh empty folder, removed with all it holds when the program ends.
std::string temporaryFolder();

/// All bytes of a file; fails the test if it cannot be read.
std::string readBytes(const std::string& path);
void writeBytes(const std::string& path, const std::string& bytes);

/// Names of all files in a folder, sorted; hidden ones included.
std::vector<std::string> listFolder(const std::string& path);

using freevoxel::silentProgress;

}  // namespace freevoxel::test
