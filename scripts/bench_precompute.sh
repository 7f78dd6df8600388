#!/usr/bin/env bash
# Measures the precompute and an opacity edit and writes docs/results/precompute.md. Wants a quiet machine and about 4 GiB
# of memory. RUN_UNDER, if set, is a command that each measurement is run under: one that waits for a quiet machine, say.
set -euo pipefail
cd "$(dirname "$0")/.."

cmake --preset release >/dev/null
cmake --build --preset release --target precompute_bench opacity_edit_bench
mkdir -p docs/results
{
  echo "# Precompute: speed"
  echo
  echo "Written by \`scripts/bench_precompute.sh\`: medians of 5 runs, all 26 directions of every brick into brick planes of"
  echo "16^3 voxels in memory, next to memset and streaming stores of as many bytes into the same buffer in the same run."
  echo "\`noise\`: every voxel independent, the worst case; \`ball\`: smooth, as data are. The sweep's own memory is kept from"
  echo "run to run. $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2- | xargs), $(nproc) cores."
  echo
  ${RUN_UNDER:-} build/release/bench/precompute 128
  for edge in 256 512; do
    ${RUN_UNDER:-} build/release/bench/precompute $edge | tail -n +3
  done
  echo
  echo "## From an opacity edit to the picture"
  echo
  echo "\`bench/opacity_edit\`: a volume of bytes that is already open, 7 edits."
  ${RUN_UNDER:-} build/release/bench/opacity_edit 256
  cat <<'TEXT'

## What bounds it

A line is the 64 bytes of one direction that are coded and stored together. The ratio to memset is missed: 0.35 of a memset of 38 GB/s
by two threads leaves each 9.6 ns a line. The host decides how much that is: the same program on the same two cores takes 11.5 to 13 ns
a line in one quarter of an hour and 15 to 20 in another (a tile that stays in the nearest cache 4.0 or 5.7), memset does 38 to 40 or
31 to 34 GB/s and streaming stores 33 to 37 or 24 to 26, so only parts and variants of the same minutes can be compared.

By leaving parts out, 256^3 `noise`, two threads, nothing else running, least of 9 sweeps, two rounds in a good quarter of an hour:

| | `voxel`, ns a line | `preintegrated`, ns a line |
|---|---:|---:|
| whole (then 383 to 427 and 202 to 212 Mvoxel/s, 39 to 44 and 79 to 83 ms) | 11.5, 12.9 | 23.2, 24.3 |
| without storing runs | 9.9, 10.1 | 21.1, 21.4 |
| without storing and coding | 8.5, 8.8 | 20.2, 20.5 |
| without looking up terms | 10.5, 10.6 | 17.9, 18.9 |
| without all of these: state and segments alone | 6.4, 6.7 | 14.4, 14.6 |

Since then fewer terms are kept (five planes instead of a slab), edges are kept once, and directions within a plane have their rows in
registers: 58 to 53 ms (`voxel`; `preintegrated` unchanged) in interleaved rounds in a bad quarter of an hour.

A tile alone, swept again and again so that it stays in the near caches, one thread, coding but no storing: directions that leave the
plane 3.9 to 4.8 ns a line (`voxel`) and 9 to 13 (`preintegrated`), those across rows 4.3 to 5.6 (6.3 to 8.1 before) and 9 to 12, those
along rows 10.5 and 17. Rows of 64, 128 or 256 voxels make no difference there, so the size of the nearest cache is not what
bounds the kernel; that state and segments alone take some 2 ns a line more in a whole sweep is put down to the caches behind it. Nor does the division of
`preintegrated`: with a product in its place segments take as long (2.5 cycles a register, measured alone). Its loads are
24 registers a line where a step goes along x, half of them across two lines of the cache: 36 accesses, at two a cycle 5 ns.

Streaming stores in this pattern alone take 3.2 to 3.5 ns a line; behind a tile that is in the near caches they add 2.0 to 2.5.

Tried, with the same bytes, and no faster (interleaved rounds, least times, most of them on a machine that others used too):
- storing the runs of the tile before one by one in between, so that they overlap with the sweep: 7.9 to 8.9 ns a line against 7.1
  to 7.7 for tiles in the near caches, 12.7 ms against 10.7 for 128^3 (presumably such stores hold up those behind them, and take the
  buffers that the next vectors' misses wait for);
- the three directions that differ in x swept together, terms loaded once for all (aligned rows moved by registers): 20.1 against 18.5 ms
  for `preintegrated` of 128^3 (the compiler runs out of registers);
- rows read along x from aligned registers that are shifted, in place of loads across lines: no change for `voxel`, slower for
  `preintegrated`, whose rows then do not all have registers;
- fetching state and edges of the next directions ahead: no change; coding each vector after the next one is swept: no change, and
  slower where it costs registers; sums along rows within quarters of a register first: no change;
- earlier: keeping what planes pass on in registers for four planes with runs stored as soon as they are coded (11.6 to 13.9 ms against
  10.5 to 12.7); ordinary stores with the next direction's lines fetched ahead for writing; brick planes in huge pages (memset
  gains more).

Memory that nobody has touched comes at 0.3 to 0.6 GB/s here; a sweep of 256^3 works on 6 MB, which a caller who sweeps again keeps
(`SweepMemory`).
TEXT
} >docs/results/precompute.md.new
mv docs/results/precompute.md.new docs/results/precompute.md
