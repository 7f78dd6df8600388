#include "tests/app/program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <sstream>

#include "tests/support/test_data.h"

namespace freevoxel::test {

std::string programPath() {
  return FREEVOXEL_PROGRAM;
}

ProcessResult freevoxel(const std::string& folder, const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {programPath()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  ProcessOptions options;
  options.folder = folder;
  return runProcess(all, options);
}

ProcessResult mpirun(const std::string& folder, int rankCount, const std::vector<std::string>& arguments,
                     int otherCount, const std::vector<std::string>& otherArguments) {
  std::vector<std::string> all = {FREEVOXEL_MPIRUN};
  const auto append = [&](int count, const std::vector<std::string>& more) {
    all.insert(all.end(), {"-n", std::to_string(count), programPath()});
    all.insert(all.end(), more.begin(), more.end());
  };
  append(rankCount, arguments);
  if (otherCount > 0) {
    all.emplace_back(":");
    append(otherCount, otherArguments);
  }
  ProcessOptions options;
  options.folder = folder;
  // For containers: root, and more ranks than cores.
  options.environment = {{"OMPI_ALLOW_RUN_AS_ROOT", "1"},
                         {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"},
                         {"OMPI_MCA_rmaps_base_oversubscribe", "1"}};
  return runProcess(all, options);
}

ProcessResult freevoxelDone(const std::string& folder, const std::vector<std::string>& arguments) {
  ProcessResult result = freevoxel(folder, arguments);
  EXPECT_EQ(result.status, 0) << ::testing::PrintToString(arguments) << "\n" << result.talk;
  return result;
}

void expectRefusal(const std::string& folder, const std::vector<std::string>& arguments, int status,
                   const std::string& expected) {
  const ProcessResult result = freevoxel(folder, arguments);
  const std::string call = ::testing::PrintToString(arguments) + ": " + result.talk;
  EXPECT_EQ(result.status, status) << call;
  EXPECT_EQ(result.output, "") << call;
  EXPECT_EQ(std::count(result.talk.begin(), result.talk.end(), '\n'), 1) << call;
  EXPECT_TRUE(result.talk.ends_with("\n")) << call;
  EXPECT_TRUE(result.talk.starts_with("freevoxel: ")) << call;
  EXPECT_NE(result.talk.find(expected), std::string::npos) << call << "expected: " << expected;
}

nlohmann::json readJson(const std::string& path) {
  return nlohmann::json::parse(readBytes(path));
}

std::vector<std::string> words(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), {}};
}

}  // namespace freevoxel::test
