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

A line is the 64 bytes of one direction that are coded and stored together. The ratio to memset is missed: 0.35 of a memset of 43 GB/s
by two threads leaves each 8.5 ns a line, of one of 39 GB/s 9.4; the best sweeps take 9.0. The host decides how much that is: the same program on the
same two processors takes 9 ns a line in one quarter of an hour and 13 in another, where one of the two, or both, run at two thirds of their
speed (one thread then does in 134 ms what two do in 125, `preintegrated`), memset does 38 to 44 or 31 to 36 GB/s; and storing alone may take three to twenty
times as long for some tenths of a second. So only parts and variants of the same minutes can be compared. Against the version before, in
interleaved rounds of 256^3 `noise` with two threads: least 36.5 to 32.4 ms, median 54 to 43 (`voxel`), 77.5 to 57.3 and 102 to 72
(`preintegrated`). Six runs of 256^3 alone, half an hour before the table above: `noise`, `voxel`, two threads 534, 532, 487, 491, 433
and 396 Mvoxel/s, 0.32, 0.32, 0.31, 0.32, 0.28 and 0.30 of memset, 0.35, 0.37, 0.37, 0.37, 0.32 and 0.34 of streaming stores.

The cost per voxel of `voxel` with two threads, least times of three rounds in which the sizes took turns: 12.7, 12.9 and 13.4 ns a line for
128^3, 256^3 and 512^3, so flat within 6 %. Sizes of the table were measured minutes apart.

Where a thread's time goes in good minutes, by the clock of the processor, 256^3 `noise`:

| | `voxel`, ms | `preintegrated`, ms |
|---|---:|---:|
| directions that leave the plane (9 of 13), depths and bytes | 10 to 11 | 24 |
| those across rows (3) | 3.6 | 7 |
| those along rows (1) | 2.2 | 3.5 |
| storing runs | 6.3 to 7.8 | 7 to 11 |
| terms of voxels: codes looked up | 3.6 to 4.6 | 8 to 10 |

The pass downwards through the planes stores and looks up more slowly than the one upwards, by 1 to 2.5 ms, whichever processor has it and wherever
its bricks lie; why is not known. If terms are read from the same plane again and again, a sweep takes 28.3 ms instead of 30.2
(`voxel`): what reading two bytes a voxel, twice by each thread, costs.

A tile alone, swept again and again so that it stays in the near caches, one thread, coding but no storing: directions that leave the
plane 3.3 to 3.7 ns a line (`voxel`; 2.5 without coding), those across rows 3.3 to 4.9, those along rows 7.7. With `preintegrated`
7.2 to 10.6 one by one, 7.8 to 9.1 three at a time (5.4 to 6.8 without coding), 12.6 along rows. A processor here does four additions, two 16-bit products,
two aligned loads, one store or one load across two lines of the cache per 0.3 ns, and a division of 16 numbers in 0.75 ns.

What made the difference since the version before: pointers that stay in registers, since the rows of everything lie at one stride and
borders need no masks (14.7 to 10.7 ms for directions that leave the plane, `voxel`); terms looked up for all rows of a plane at once, with the
next strip's fetched in step (5 to 4 ms, and 15 to 9); sums along rows before their bytes (2.9 to 2.3 ms); state of the next strip
fetched while this one is swept (3 to 7 %); with `preintegrated` the three directions that differ in x together, row by row
(59 to 54 ms): terms of a tile are 90 KB, and are read from the second cache for three directions at once.

Streaming stores in this pattern alone take 3.2 to 3.5 ns a line.

Tried, with the same bytes, and no faster (interleaved rounds, least times):
- storing the runs of the direction before a quarter at a time, between the planes of the next one, so that they overlap: 35.1 ms against 31.5
  (`voxel`), also if all that planes pass on is loaded just as it was stored, so that it need not reach the cache first: 43.8 against 40.4 (a trial whose
  directions shared a buffer too early, so some of its bytes were wrong; the work was the same). One run at
  a time within the kernel was no faster either;
- state in registers for four planes where a direction leads straight from plane to plane: 31.4 against 30.9;
- rows and edges of the next direction fetched while this one is swept: 31.1 against 31.3, and 58.8 against 57.4 (`preintegrated`);
- depths across rows before their bytes, as along rows: 32.7 against 32.8, and 64.1 against 60.7;
- coding in a loop of its own, one direction at a time (`preintegrated`): 127 against 124;
- groups of directions handed to whichever thread is free: no change where both are equally fast, nor where one is held up;
- earlier, with other kernels: rows read along x from aligned registers that are shifted; coding each vector after the next one is swept; sums
  along rows within quarters of a register first; ordinary stores with the next direction's lines fetched ahead for writing; brick
  planes in huge pages (memset gains more).

Memory that nobody has touched comes at 0.3 to 0.6 GB/s here; a sweep of 256^3 works on 6 MB, which a caller who sweeps again keeps
(`SweepMemory`). Memory that is given back to the system is given back to the host, and slows down what runs in the seconds after: with it
the attenuation stage of the opacity edit took 147 to 244 ms instead of 84 to 91 (three runs each, halfway through these changes), which is
why that program keeps what it has.
TEXT
} >docs/results/precompute.md.new
mv docs/results/precompute.md.new docs/results/precompute.md
