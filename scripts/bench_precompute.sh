#!/usr/bin/env bash
# Measures the precompute and writes docs/results/precompute.md. Wants a quiet machine and about 4 GiB of memory.
set -euo pipefail
cd "$(dirname "$0")/.."

cmake --preset release >/dev/null
cmake --build --preset release --target precompute_bench
mkdir -p docs/results
{
  echo "# Precompute: speed"
  echo
  echo "Written by \`scripts/bench_precompute.sh\`: medians of 5 runs, all 26 directions of every brick into brick planes of"
  echo "16^3 voxels in memory, next to memset and streaming stores of as many bytes into the same buffer in the same run."
  echo "\`noise\`: every voxel independent, the worst case; \`ball\`: smooth, as data are. $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2- | xargs), $(nproc) cores."
  echo
  build/release/bench/precompute
} >docs/results/precompute.md.new
mv docs/results/precompute.md.new docs/results/precompute.md
