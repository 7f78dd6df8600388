#include "app/signals.h"

#include <signal.h>

#include "base/atomic_file.h"

namespace freevoxel {

namespace {

extern "C" void removeFilesAndEnd(int number) {
  removeTemporaryFiles();
  // The shell should see that a signal ended us.
  signal(number, SIG_DFL);
  raise(number);
}

}  // namespace

void cleanUpOnSignals() {
  struct sigaction action {};
  action.sa_handler = removeFilesAndEnd;
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    // A signal that our parent had us ignore (nohup) stays ignored.
    if (sigaction(number, nullptr, &before) == 0 && before.sa_handler != SIG_IGN) sigaction(number, &action, nullptr);
  }
}

}  // namespace freevoxel
