#!/usr/bin/env bash
# The same sums over ranks, partitions, threads and backends: a CT head and a volume of 5 x 7 x 11, 256 x 256 pixels.
#   scripts/check_ranks.sh build/release/bin/freevoxel DATA
# DATA: the folder of the real data sets. RANKS, PARTITIONS, THREADS, BACKENDS narrow the matrix. Exit status 0 if all agree.
set -euo pipefail
program=$(realpath "$1")
data=$(realpath "$2")
transfer=$(realpath "$(dirname "$0")/../examples/transfer/headsq.json")
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

"$program" precompute "$data/volumes/headsq/quarter.nhdr" --transfer "$transfer" -o head.fvx --quiet
"$program" generate checkered-cloud --dims 5,7,11 --spacing 0.3,1.1,2.7 --seed 7 -o small.nrrd
echo '{"range": [0, 255], "points": [{"value": 0, "color": [0.1, 0.2, 0.9], "opacity": 0.0},
       {"value": 40, "color": [0.9, 0.5, 0.1], "opacity": 0.1}, {"value": 255, "color": [1, 1, 0.9], "opacity": 0.6}]}' >t.json
"$program" precompute small.nrrd --transfer t.json -o small.fvx --quiet

runs=0 wrong=0 started=$SECONDS
for volume in head small; do
  hash=
  for backend in ${BACKENDS:-cpu gl}; do
    for ranks in ${RANKS:-1 2 3 5 8 16}; do
      for partition in ${PARTITIONS:-round-robin hilbert slab random:1}; do
        for threads in ${THREADS:-1 2}; do
          mpirun -n "$ranks" "$program" render $volume.fvx --size 256x256 -o p.png --sums s.exr --stats s.json --quiet \
            --partition "$partition" --threads "$threads" --backend "$backend"
          found=$(sed -n '/"sumsHashes"/{n;s/[^0-9a-f]//gp}' s.json)
          hash=${hash:-$found}
          runs=$((runs + 1))
          if [[ $found != "$hash" ]]; then
            wrong=$((wrong + 1))
            echo "$volume: $ranks ranks, $partition, $threads threads, $backend: expected $hash, found $found"
          fi
        done
      done
    done
  done
  echo "$volume: $hash"
done
echo "$runs runs, $wrong of them differ, $((SECONDS - started)) s"
((wrong == 0))
