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
  cat <<'TEXT'

## What bounds it

By leaving parts out and by sampling, one thread, `noise` of 128^3, least of 60 to 120 sweeps on a machine that others used too; a line is the
64 bytes of one direction that are coded and stored together. Of 11.6 ms (`voxel`), 45 cycles of 3.3 GHz a line, storing runs takes 2.3 to
2.6 ms, coding 1 to 2 ms, and state, terms and what is read ahead the rest, some 8 ms; about 2 of these are looking up terms and
prefetching codes. `preintegrated` adds 9 ms for segments: five loads a voxel, two of them unaligned, of rows that take 56 kB for a
tile of 256 voxels, more than the nearest cache holds.

Streaming stores in this pattern alone take 11 cycles a line, in order or scattered, and memset 5.7: one thread cannot pass half of memset
however little it computes. 0.35 of a memset of 35 GB/s by two threads leaves each 34 cycles a line.

Tried, with the same bytes, and no faster: keeping what planes pass on in registers for four planes, so that rows are
loaded aligned and stored once in four planes, with runs stored as soon as they are coded (11.6 to 13.9 ms against 10.5 to 12.7 in
interleaved rounds: about a third of the samples then wait at the first streaming store of a group); ordinary stores with the next
direction's lines fetched ahead for writing (no gain to be seen, on a loaded machine). Brick planes in huge pages: 10.6 to 11.2 ms,
but memset gains more (1.4 to 1.6 against 2.0 to 2.1 ms).
TEXT
} >docs/results/precompute.md.new
mv docs/results/precompute.md.new docs/results/precompute.md
