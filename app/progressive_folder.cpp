#include "app/progressive_folder.h"

#include <algorithm>

#include "base/error.h"
#include "base/image.h"

namespace freevoxel {

namespace {

bool isNumbered(const std::filesystem::path& file) {
  const std::string number = file.stem().string(), extension = file.extension().string();
  return number.size() >= 2 && std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; }) &&
         (extension == ".png" || extension == ".exr");
}

bool isOurs(const std::filesystem::path& file) {
  try {
    const std::string command = readImageCommand(file.string());
    return command.starts_with("freevoxel render ") && command.find(" --progressive") != std::string::npos;
  } catch (const InputError&) {
    return false;  // no picture at all
  }
}

}  // namespace

std::vector<std::filesystem::path> picturesOfEarlierRun(const std::filesystem::path& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem) throw MachineError(fmt::format("{}: cannot be made: {}", folder.string(), problem.message()));
  std::vector<std::filesystem::path> pictures;
  std::filesystem::directory_iterator entry(folder, problem);
  for (; !problem && entry != std::filesystem::directory_iterator(); entry.increment(problem)) {
    if (!isNumbered(entry->path())) continue;
    if (!isOurs(entry->path())) {
      throw InputError(
          fmt::format("{}: is in the way: --progressive numbers its pictures so, and replaces only those that an "
                      "earlier run wrote; move it, or name another folder",
                      entry->path().string()));
    }
    pictures.push_back(entry->path());
  }
  if (problem) throw MachineError(fmt::format("{}: cannot be read: {}", folder.string(), problem.message()));
  return pictures;
}

void removeAll(const std::vector<std::filesystem::path>& files) {
  for (const std::filesystem::path& file : files) {
    std::error_code problem;
    std::filesystem::remove(file, problem);
    if (problem) throw MachineError(fmt::format("{}: cannot be removed: {}", file.string(), problem.message()));
  }
}

}  // namespace freevoxel
