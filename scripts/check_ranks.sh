#!/usr/bin/env bash
# The same sums over ranks, partitions, threads and backends: CThead resampled to 64 x 64 x 57, and a volume of 5 x 7 x 11,
# 256 x 256 pixels.
#   scripts/check_ranks.sh build/release/bin/freevoxel DATA
# DATA: the folder of the real data sets. RANKS, PARTITIONS, THREADS, BACKENDS narrow the matrix. The hashes of the sums
# are kept in check_ranks.expected; STORE=1 writes them anew. Exit status 0 if all agree with each other and with these.
# Bits do not depend on anything that varies here. They do depend on the maths library, which makes the tables of
# attenuation and transfer functions: those stored are of glibc 2.36 on x86-64.
set -euo pipefail
program=$(realpath "$1")
data=$(realpath "$2")
here=$(realpath "$(dirname "$0")")
transfer=$here/../examples/transfer/cthead.json
expected=$here/check_ranks.expected
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
# Threads that wait leave the core to those that work.
export OMP_WAIT_POLICY=passive
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

"$program" precompute "$data/volumes/cthead_256x256x113_uint16_be.raw.gz" --dims 256,256,113 --type u16 --endian big \
  --spacing 1,1,2 --resolution 64 --transfer "$transfer" -o cthead.fvx --quiet
"$program" generate checkered-cloud --dims 5,7,11 --spacing 0.3,1.1,2.7 --seed 7 -o small.nrrd
echo '{"range": [0, 255], "points": [{"value": 0, "color": [0.1, 0.2, 0.9], "opacity": 0.0},
       {"value": 40, "color": [0.9, 0.5, 0.1], "opacity": 0.1}, {"value": 255, "color": [1, 1, 0.9], "opacity": 0.6}]}' >t.json
"$program" precompute small.nrrd --transfer t.json -o small.fvx --quiet

runs=0 wrong=0 started=$SECONDS
for volume in cthead small; do
  hash=
  for backend in ${BACKENDS:-cpu gl}; do
    for ranks in ${RANKS:-1 2 3 5 8 16}; do
      for partition in ${PARTITIONS:-round-robin hilbert slab random:1}; do
        for threads in ${THREADS:-1 2}; do
          mpirun -n "$ranks" "$program" render $volume.fvx --size 256x256 --orbit 35,25 -o p.png --sums s.exr --stats s.json \
            --quiet --partition "$partition" --threads "$threads" --backend "$backend"
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
  echo "$volume $hash" | tee -a hashes
done
echo "$runs runs, $wrong of them differ, $((SECONDS - started)) s"
((wrong == 0))
if [[ ${STORE:-0} == 1 ]]; then
  cp hashes "$expected"
elif ! diff "$expected" hashes; then
  echo "all runs agree, but not with the stored hashes: another maths library, or another picture"
  exit 1
fi
