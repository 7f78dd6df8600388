#include "app/plot.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "app/input_file.h"
#include "base/atomic_file.h"
#include "base/error.h"

namespace freevoxel {

namespace {

/// As a gnuplot string.
std::string quotedText(const std::string& text) {
  std::string result = "'";
  for (const char c : text)
    result += c == '\'' ? "''" : std::string(1, c);
  return result + "'";
}

std::string script(const std::string& output, bool svg, const std::string& xLabel,
                   const std::vector<PlotPanel>& panels) {
  constexpr int kPanelWidth = 640, kHeight = 560;
  const int width = kPanelWidth * int(panels.size());
  std::string text =
      svg ? fmt::format("set terminal svg size {},{} font 'sans,13' background 'white'\n", width, kHeight)
          : fmt::format("set terminal pngcairo size {},{} font 'sans,11'\n", width, kHeight);
  text += fmt::format(
      "set output {}\nset multiplot layout 1,{}\nset logscale x 2\nset grid\nset key left top\nset xlabel {}\n",
      quotedText(output), panels.size(), quotedText(xLabel));
  for (const PlotPanel& panel : panels) {
    text += fmt::format("set title {}\nset ylabel {}\n{}\n", quotedText(panel.title), quotedText(panel.yLabel),
                        panel.logarithmicY ? "set logscale y 2" : "unset logscale y");
    text += panel.logarithmicY ? "set autoscale y\nset key left top\n" : "set yrange [0:1.02]\nset key left bottom\n";
    std::string curves, data;
    for (size_t i = 0; i < panel.curves.size(); ++i) {
      const Curve& curve = panel.curves[i];
      curves +=
          fmt::format("{}'-' title {} noenhanced with linespoints linewidth 2 pointtype {} dashtype {}",
                      i == 0 ? "" : ", ", quotedText(curve.name), curve.dashed ? 0 : i % 12 + 4, curve.dashed ? 2 : 1);
      for (const auto& [x, y] : curve.points)
        data += fmt::format("{} {}\n", x, y);
      data += "e\n";
    }
    text += "plot " + curves + '\n' + data;
  }
  return text + "unset multiplot\n";
}

/// Gives gnuplot the script, and returns what it says, empty if all is well.
std::string runGnuplot(const std::string& commands) {
  std::array<int, 2> input{}, talk{};
  if (pipe2(input.data(), O_CLOEXEC) != 0 || pipe2(talk.data(), O_CLOEXEC) != 0)
    throw MachineError("cannot make a pipe to gnuplot");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, talk[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, talk[1], STDERR_FILENO);
  const char* arguments[] = {"gnuplot", nullptr};
  pid_t child = 0;
  const int problem = posix_spawnp(&child, "gnuplot", &actions, nullptr, const_cast<char**>(arguments), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(input[0]);
  close(talk[1]);
  if (problem != 0) {
    close(input[1]);
    close(talk[0]);
    throw MachineError(
        fmt::format("cannot start gnuplot, which draws plots: {}; install gnuplot-nox or leave --plot out",
                    std::strerror(problem)));
  }
  // It reads all of its script before it says much, and may end before it has read it.
  struct sigaction ignore {
  }, before{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, &before);
  for (size_t written = 0; written < commands.size();) {
    const ssize_t count = write(input[1], commands.data() + written, commands.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    written += size_t(count);
  }
  close(input[1]);
  sigaction(SIGPIPE, &before, nullptr);
  std::string said;
  std::array<char, 4096> buffer;
  for (;;) {
    const ssize_t count = read(talk[0], buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    said.append(buffer.data(), size_t(count));
  }
  close(talk[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  return said.empty() ? "it failed" : said;
}

}  // namespace

void plot(const std::string& path, const std::string& xLabel, const std::vector<PlotPanel>& panels) {
  AtomicFile file(path);
  const std::string said = runGnuplot(script(file.temporaryPath(), lowerCaseExtension(path) == "svg", xLabel, panels));
  if (!said.empty()) throw MachineError(fmt::format("{}: gnuplot cannot draw it: {}", path, said));
  file.commit();
}

}  // namespace freevoxel
