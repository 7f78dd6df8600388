// The program that reads with libraries while the tests run: what freevoxel does when started as a reader, and the
// misbehaviour of a library for requests whose first file is asked for it (its name ends in .die.vdb and so on).
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "volume/child_reader.h"

namespace {

/// What stands on standard input, which is left as it was.
std::string peekAtRequest() {
  std::string text(4096, '\0');
  const ssize_t got = pread(STDIN_FILENO, text.data(), text.size(), 0);
  text.resize(got > 0 ? size_t(got) : 0);
  return text;
}

void eatMemory() {
  // The limit that the request carries is set by the real reader; here it is small, to be quick.
  const rlimit memory{uint64_t(512) << 20, uint64_t(512) << 20};
  setrlimit(RLIMIT_AS, &memory);
  std::vector<char*> blocks;
  for (;;) {
    blocks.push_back(new char[size_t(1) << 24]);
    std::memset(blocks.back(), 1, size_t(1) << 24);
  }
}

}  // namespace

int main() {
  const std::string request = peekAtRequest();
  const auto asked = [&](const char* what) { return request.find(what) != std::string::npos; };
  if (asked(".die.vdb")) {
    std::fputs("the library is unhappy\nvery much so\n", stderr);
    signal(SIGSEGV, SIG_DFL);  // the sanitizers have a handler of their own
    raise(SIGSEGV);
  }
  if (asked(".hang.vdb")) pause();
  if (asked(".spin.vdb")) {
    const rlimit processor{1, 2};
    setrlimit(RLIMIT_CPU, &processor);
    for (volatile bool on = true; on;) {
    }
  }
  if (asked(".eat.vdb")) eatMemory();
  if (asked(".nonsense.vdb")) {
    const std::string nonsense(1000, 'n');
    return write(STDOUT_FILENO, nonsense.data(), nonsense.size()) < 0 ? 1 : 0;
  }
  if (asked(".leave.vdb")) return 3;
  freevoxel::runLibraryReader();
}
