#!/usr/bin/env bash
# Builds and runs the tests, except those that take long (scripts/test_full.sh).
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install_dependencies.sh
cmake --preset release >/dev/null
cmake --build --preset release --parallel "$(nproc)"
scripts/run_tests.sh build/release --label-exclude full
