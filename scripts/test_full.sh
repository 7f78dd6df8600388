#!/usr/bin/env bash
# All tests, those that take long among them: the real data sets through the whole line (FREEVOXEL_DATA names their
# folder; without it they are skipped), and everything once more under the sanitizers.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install_dependencies.sh
for preset in release sanitizers; do
  cmake --preset "$preset" >/dev/null
  cmake --build --preset "$preset" --parallel "$(nproc)"
done
scripts/run_tests.sh build/sanitizers --label-exclude full
scripts/run_tests.sh build/release
