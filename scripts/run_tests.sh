#!/usr/bin/env bash
# Runs the tests of a build folder and ends with one line that counts them:
#   scripts/run_tests.sh build/release -L quick
# What follows the folder goes to ctest. Exit status: ctest's.
set -euo pipefail
folder=$1
shift

report=$folder/test_report.xml
rm -f "$report"
status=0
ctest --test-dir "$folder" --parallel 2 --output-on-failure --no-tests=error --output-junit "$(realpath -m "$report")" "$@" ||
  status=$?

count() { # of an attribute of the report's first element
  sed -n "/<testsuite /,/>/s/.*\b$1=\"\([0-9]*\)\".*/\1/p" "$report" | head -n 1
}
if [[ -f $report ]]; then
  tests=$(count tests) failed=$(count failures) skipped=$(($(count skipped) + $(count disabled)))
  echo "$((tests - failed - skipped)) passed, $failed failed, $skipped skipped"
fi
exit "$status"
