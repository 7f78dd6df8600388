#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <stdexcept>

namespace freevoxel::test {

namespace {

[[noreturn]] void becomeProgram(const std::vector<std::string>& arguments, const ProcessOptions& options, int output,
                                int talk) {
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(talk, STDERR_FILENO);
  if (!options.folder.empty() && chdir(options.folder.c_str()) != 0) _exit(126);
  for (const auto& [name, value] : options.environment)
    setenv(name.c_str(), value.c_str(), 1);
  const rlimit data{options.dataBytes, options.dataBytes};
  if (options.dataBytes > 0 && setrlimit(RLIMIT_DATA, &data) != 0) _exit(125);
  std::vector<char*> argv;
  for (const std::string& argument : arguments)
    argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  execv(argv[0], argv.data());
  _exit(127);
}

}  // namespace

ProcessResult runProcess(const std::vector<std::string>& arguments, const ProcessOptions& options) {
  std::array<int, 2> output{}, talk{};
  if (pipe2(output.data(), O_CLOEXEC) != 0 || pipe2(talk.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("cannot fork");
  if (child == 0) becomeProgram(arguments, options, output[1], talk[1]);
  close(output[1]);
  close(talk[1]);

  ProcessResult result;
  const auto start = std::chrono::steady_clock::now();
  bool signalDue = options.signal != 0;
  std::array<pollfd, 2> readers{{{output[0], POLLIN, 0}, {talk[0], POLLIN, 0}}};
  int open = 2;
  while (open > 0) {
    poll(readers.data(), readers.size(), 20);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (signalDue && elapsed.count() >= options.signalAfter) {
      kill(child, options.signal);
      signalDue = false;
    }
    for (size_t i = 0; i < readers.size(); ++i) {
      if (readers[i].fd < 0 || (readers[i].revents & (POLLIN | POLLHUP)) == 0) continue;
      std::array<char, 4096> buffer;
      const ssize_t count = read(readers[i].fd, buffer.data(), buffer.size());
      if (count > 0) {
        (i == 0 ? result.output : result.talk).append(buffer.data(), size_t(count));
      } else {
        close(readers[i].fd);
        readers[i].fd = -1;
        --open;
      }
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  result.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace freevoxel::test
