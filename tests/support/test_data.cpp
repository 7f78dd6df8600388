#include "tests/support/test_data.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <sstream>
#include <vector>

namespace freevoxel::test {

namespace fs = std::filesystem;

namespace {

/// Folders to remove at exit.
struct TemporaryFolders {
  std::mutex mutex;
  std::vector<fs::path> paths;
  ~TemporaryFolders() {
    std::error_code ignored;
    for (const fs::path& path : paths)
      fs::remove_all(path, ignored);
  }
};

}  // namespace

std::optional<std::string> dataFolder() {
  const char* named = getenv("FREEVOXEL_DATA");
  const fs::path folder = named != nullptr ? fs::path(named) : fs::path(sourceFolder()) / "../shared/data";
  if (!fs::is_directory(folder)) return std::nullopt;
  return fs::canonical(folder).string();
}

std::string sourceFolder() {
  return FREEVOXEL_SOURCE_FOLDER;
}

std::string temporaryFolder() {
  static TemporaryFolders folders;
  std::string path = (fs::temp_directory_path() / "freevoxel-test-XXXXXX").string();
  if (mkdtemp(path.data()) == nullptr) throw std::runtime_error("cannot make a folder in " + path);
  const std::lock_guard lock(folders.mutex);
  folders.paths.push_back(path);
  return path;
}

std::string readBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << "cannot read " << path;
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

void writeBytes(const std::string& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  EXPECT_TRUE(file.good()) << "cannot write " << path;
}

std::vector<std::string> listFolder(const std::string& path) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(path))
    names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace freevoxel::test
