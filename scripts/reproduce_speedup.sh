#!/usr/bin/env bash
# Measures what ranks are worth, and draws the FreeVoxels paper's Figure 8 again, into docs/results/speedup:
#   scripts/reproduce_speedup.sh [balance] [figure8] [composite] [memory]
# All of them unless some are named. DATA is the folder with the real volumes (default ../shared/data), CACHE that for
# attenuation files, which are made once (default build/speedup; a volume of 1024^3 needs 1.3 GB there while its file is made).
# What is counted (balance, memory) does not depend on the machine; times (figure8, composite) want a quiet one.
set -euo pipefail
cd "$(dirname "$0")/.."
data=${DATA:-../shared/data}
cache=${CACHE:-build/speedup}
build=${BUILD:-build/release}
out=${OUT:-docs/results/speedup}
wanted=("$@")
[ ${#wanted[@]} -gt 0 ] || wanted=(balance figure8 composite memory)
program=$build/bin/freevoxel
# For containers: root, and more ranks than cores.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1 OMP_WAIT_POLICY=passive
mkdir -p "$cache" "$out"

makeCarp() {
  [ -e "$cache/carp.fvx" ] ||
    "$program" precompute "$data/volumes/carp.nii.gz" --transfer examples/transfer/carp.json --layout compact \
      -o "$cache/carp.fvx" --quiet
}

makeCloud() {
  [ -e "$cache/cloud_1024.fvx" ] && return
  "$program" generate cloud --dims 1024,1024,1024 -o "$cache/cloud_1024.nrrd" --quiet
  "$program" precompute "$cache/cloud_1024.nrrd" --transfer examples/transfer/cloud.json --layout compact --memory 1G \
    -o "$cache/cloud_1024.fvx" --quiet
  rm "$cache/cloud_1024.nrrd"
}

# FILE OPTIONS...: the command as it is typed where the files are, and what it prints.
tell() {
  local file=$1
  shift
  printf '```\nfreevoxel speedup %s' "$file"
  printf ' %s' "${@/#"$out/"/}"
  printf '\n\n'
  "$program" speedup "$cache/$file" "$@"
  printf '```\n'
}

balance() {
  makeCarp
  makeCloud
  {
    printf '# Balance, counted\n\nMean over largest share of a rank. Splats are visible voxels of the blocks in view, pieces here the pixels\n'
    printf 'that their bounding rectangles cover; means over 64 views spread over the sphere, and the worst of them. Blocks of 32 are\n'
    printf 'what is drawn by default. Written by `scripts/reproduce_speedup.sh balance`.\n\n## carp, 256 x 512 x 256\n\n'
    tell carp.fvx --count --views 64 --ranks 8,16,32,64,96,128 --partition round-robin,hilbert,slab,random:1 --block 16,32 \
      --plot "$out/balance_carp.png" --plot "$out/balance_carp.svg"
    printf '\n![Balance over ranks, carp](balance_carp.png)\n\n## cloud, 1024 x 1024 x 1024\n\n'
    tell cloud_1024.fvx --count --views 64 --ranks 8,32,128,512,2048,4096 --partition round-robin,hilbert,slab,random:1 \
      --block 16,32 --plot "$out/balance_cloud_1024.png" --plot "$out/balance_cloud_1024.svg"
    printf '\n![Balance over ranks, cloud of 1024^3](balance_cloud_1024.png)\n'
  } >"$out/balance.md"
}

figure8() {
  makeCarp
  {
    printf '# Speedup, timed (papers/freevoxels Fig. 8)\n\nVirtual ranks that draw one after another on this machine, each with one thread, the time\n'
    printf 'that the processor worked: T(1) over the slowest rank, without and with the composite, which is worked out from bytes and\n'
    printf 'measured rates. %s cores. Written by `scripts/reproduce_speedup.sh figure8`.\n\n' "$(nproc)"
    tell carp.fvx --attenuation interpolated --size 1000x1000 --orbit 35,25 --threads 1 --clock processor --repeat 2 \
      --block 16,32 --plot "$out/figure8.png" --plot "$out/figure8.svg"
    printf '\n![Speedup and balance over ranks](figure8.png)\n'
  } >"$out/figure8.md"
}

composite() {
  {
    printf '# Composite, timed\n\nWritten by `scripts/reproduce_speedup.sh composite`.\n\n'
    scripts/bench_composite.sh "$build"
  } >"$out/composite.md"
}

# Largest number of a key in a statistics file, MB.
largest() { sed -n "s/.*\"$1\": \([0-9]*\).*/\1/p" "$2" | sort -n | tail -1 | awk '{printf "%.1f", $1 / 1e6}'; }

memory() {
  makeCarp
  {
    printf '# Memory of a rank\n\ncarp, 512 x 512 pixels, `--attenuation interpolated`: a rank reads the bricks of its blocks and those\n'
    printf 'that touch them. MB of the rank that takes most: `volumeBytes` is what is unpacked of the volume, `peakMemoryBytes` the whole\n'
    printf 'process, libraries, image and tables included. Written by `scripts/reproduce_speedup.sh memory`.\n\n'
    printf '| ranks | partition | volumeBytes | peakMemoryBytes |\n|---|---|---|---|\n'
    for partition in round-robin hilbert; do
      for ranks in 1 2 4 8; do
        mpirun -n "$ranks" "$program" render "$cache/carp.fvx" --attenuation interpolated --size 512x512 --threads 1 \
          --partition "$partition" --stats "$cache/stats.json" -o "$cache/carp.png" --quiet
        echo "| $ranks | $partition | $(largest volumeBytes "$cache/stats.json") | $(largest peakMemoryBytes "$cache/stats.json") |"
      done
    done
  } >"$out/memory.md"
}

for what in "${wanted[@]}"; do
  case $what in
    balance | figure8 | composite | memory) "$what" ;;
    *)
      echo "$what: expected balance, figure8, composite or memory" >&2
      exit 2
      ;;
  esac
done
