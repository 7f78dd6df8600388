#!/usr/bin/env bash
# Draws the FreeVoxels paper's Figures 2 to 7 and measures the tables of docs/fidelity.md and docs/results/hierarchy.md, into
# docs/results:
#   scripts/reproduce_freevoxels.sh [figures] [quality] [shadows] [inside] [hidden] [lights] [levels]
# All of them unless some are named. Builds the release preset if need be. DATA is the folder with the real volumes
# (default ../shared/data; without it those columns are left out); references are kept in CACHE (default
# build/references) and cast only once; VIEWS and SIZE make everything quicker (defaults 20 and 512).
set -euo pipefail
cd "$(dirname "$0")/.."
data=${DATA:-../shared/data}
cache=${CACHE:-build/references}
views=${VIEWS:-20}
size=${SIZE:-512}
out=${OUT:-docs/results/freevoxels}
build=${BUILD:-build/release}
wanted=("$@")
[ ${#wanted[@]} -gt 0 ] || wanted=(figures quality shadows inside hidden lights levels)

if [ ! -x "$build/bin/freevoxel_fidelity" ]; then
  cmake --preset release -DFREEVOXEL_BENCH=ON
  cmake --build --preset release --parallel "$(nproc)"
fi
program=$build/bin/freevoxel
fidelity=("$build/bin/freevoxel_fidelity" --data "$data" --transfers examples/transfer --cache "$cache"
  --views "$views" --size "$size")
mkdir -p "$out"

plot() { # PNG AXES LINES
  gnuplot <<PLOT
set terminal pngcairo size 720,420 font "sans,10"
set output "$1"
set key below
$2
plot ${3//$'\n'/ }
PLOT
}

figures() {
  local scratch
  scratch=$(mktemp -d)
  "${fidelity[@]}" figures -o "$scratch"
  cp "$scratch/figure2.png" "$out/figure2.png"
  local d=$scratch/figure4.dat
  plot "$out/figure4.png" 'set xlabel "position, voxels"; set ylabel "weight"; set yrange [0:2]' \
    "'$d' using 1:2 with lines title 'one kernel', '$d' using 1:3 with lines lw 2 title 'sum over a plane of voxels',
     '$d' using 1:4 with lines title 'the same of Gaussians of area 1', '$d' using 1:5 with lines title 'of peak 1'"
  for d in figure6 figure6-slab; do
    plot "$out/$d-alpha.png" 'set xlabel "pixel of the middle row"; set ylabel "alpha"; set yrange [0:1.05]' \
      "'$scratch/$d.dat' using 1:3 with lines title 'blended, Gaussian of peak 1', '' using 1:4 with lines title 'blended, normalised',
       '' using 1:5 with lines title 'order-free kernels', '' using 1:6 with lines lw 2 title 'order-free cells',
       '' using 1:2 with lines dt 2 lc 'black' title 'closed form'"
    "$program" sheet "$scratch/$d"-{blended-gaussian,blended-normalised,kernels,cells}.png --columns 4 -o "$scratch/$d.png" --quiet
  done
  "$program" sheet "$scratch"/figure6{,-slab}.png --columns 1 -o "$out/figure6.png" --quiet

  local head=$data/volumes/cthead_256x256x113_uint16_be.raw.gz
  if [ -e "$head" ]; then
    local -a view=(--dims 256,256,113 --type u16 --endian big --spacing 1,1,2 --transfer examples/transfer/cthead.json
      --eye 60,-420,-120 --target 127,127,112 --up 0,0,-1 --fov 30 --size 400x400 --ambient 0.1 --quiet)
    "$program" render "$head" "${view[@]}" --light-direction=-1,-0.7,-0.6,1,0.05,0.05 -o "$scratch/red.png"
    "$program" render "$head" "${view[@]}" --light-direction=-1,-0.7,-0.6 -o "$scratch/white.png"
    "$program" render "$head" "${view[@]}" --light-direction=-1,-0.7,-0.6,1,0.3,0.1 \
      --light-direction=1,-0.5,-0.4,0.1,0.35,1 -o "$scratch/two.png"
    "$program" sheet "$scratch"/{red,white,two}.png --columns 3 -o "$out/figure7.png" --quiet

    # Close to the head, so that blocks of several levels are needed.
    "$program" precompute "$head" "${view[@]:0:8}" --transfer examples/transfer/cthead.json --layout compact --levels 0 \
      -o "$scratch/head.fvx" --quiet
    local -a near=("$scratch/head.fvx" --eye=-30,-60,60 --target 140,127,112 --up 0,0,-1 --fov 60 --size 400x400 --quiet)
    "$program" render "${near[@]}" -o "$scratch/finest.png"
    "$program" render "${near[@]}" --lod 12 -o "$scratch/cut.png"
    "$program" render "${near[@]}" --lod 12 --colour-by level -o "$scratch/levels.png"
    "$program" sheet "$scratch"/{finest,cut,levels}.png --columns 3 -o "$out/figure3.png" --quiet
    if command -v mpirun > /dev/null; then
      OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 LP_NUM_THREADS=1 mpirun --oversubscribe -n 4 \
        "$program" render "${near[@]}" --lod 12 --colour-by rank --threads 1 -o "$scratch/ranks.png"
      "$program" sheet "$scratch"/{levels,ranks}.png --columns 2 -o "$out/figure5.png" --quiet
    fi
  fi
  rm -r "$scratch"
}

for what in "${wanted[@]}"; do
  case $what in
    figures) figures ;;
    quality | shadows | hidden) "${fidelity[@]}" "$what" -o "$out/$what.md" ;;
    inside) "${fidelity[@]}" inside --columns cloud,cthead -o "$out/inside.md" ;;
    levels) DATA=$data CACHE=$cache BUILD=$build scripts/bench_hierarchy.sh levels ;;
    lights) "${fidelity[@]}" lights --columns cloud,cthead,embryo -o "$out/lights.md" ;;
    *) echo "expected figures, quality, shadows, inside, hidden, lights or levels, found '$what'" >&2; exit 2 ;;
  esac
done
echo "results: $out"
