// The main function of every test program.
#include <gtest/gtest.h>
#include <stdlib.h>

#include "tests/support/test_data.h"

// The sanitizers' run-time libraries ask these; elsewhere nobody does.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" {
const char* __ubsan_default_options();
const char* __ubsan_default_options() {
  return "print_stacktrace=1";
}
const char* __lsan_default_options();
const char* __lsan_default_options() {
  return "print_suppressions=0";
}
const char* __lsan_default_suppressions();
const char* __lsan_default_suppressions() {
  return FREEVOXEL_LEAKS;
}  // those of leaks.supp
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

int main(int argc, char** argv) {
  // For the programs that tests start.
  const std::string leaks = freevoxel::test::sourceFolder() + "/tests/support/leaks.supp";
  setenv("LSAN_OPTIONS", ("print_suppressions=0:suppressions=" + leaks).c_str(), 0);
  setenv("UBSAN_OPTIONS", "print_stacktrace=1", 0);
  // llvmpipe's threads; machines that run tests have more to do.
  setenv("LP_NUM_THREADS", "2", 0);
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
