#include "app/input_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <fstream>

#include "base/atomic_file.h"
#include "base/error.h"
#include "precompute/format.h"
#include "volume/file_start.h"
#include "volume/numpy_array.h"

namespace freevoxel {

bool isAttenuationFile(const std::string& path) {
  std::array<uint8_t, kFileMagic.size()> start{};
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(start.data()), start.size());
  if (!file.good() || start != kFileMagic) return false;
  if (isTemporaryName(path)) {
    throw InputError(fmt::format("{}: the unfinished file of a run that is at work or was killed; run it again", path));
  }
  return true;
}

uint64_t fileBytes(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) return fs::file_size(path, ignored);
  uint64_t bytes = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, ignored)) {
    if (entry.is_regular_file(ignored)) bytes += entry.file_size(ignored);
  }
  return bytes;
}

bool isVolumeArray(const std::string& path) {
  const FileStart start = readFileStart(path);
  return isNumpyArray(start) && numpyAxes(start) > 2;
}

std::string lowerCaseExtension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  if (!extension.empty()) extension.erase(0, 1);
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return extension;
}

}  // namespace freevoxel
