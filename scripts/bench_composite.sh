#!/usr/bin/env bash
# Adding the pictures of several ranks of this machine: covered tiles against one MPI_Reduce. Prints a table.
#   scripts/bench_composite.sh [build/release]
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/release}
# For containers: root, and more ranks than cores.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1

echo "Medians of 20 interleaved runs, milliseconds; $(nproc) cores. Covered: the share of the image in which there is anything."
echo
echo "| ranks | image | covered | tiles | MPI_Reduce | ratio | most MB sent by a rank | MB of the image |"
echo "|---|---|---|---|---|---|---|---|"
for size in "1000 1000" "3840 2160"; do
  read -r width height <<<"$size"
  for cover in 0.4 1; do
    for ranks in 2 4 8; do
      mpirun -n "$ranks" "$build/bench/composite" --width "$width" --height "$height" --cover "$cover"
    done
  done
done
