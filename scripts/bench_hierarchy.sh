#!/usr/bin/env bash
# Measures what levels of detail are worth and what they cost, and writes docs/results/hierarchy.md and its pictures:
#   scripts/bench_hierarchy.sh [levels] [refinement] [detail] [size] [pictures]
# All parts unless some are named; the others stay as they were written last. DATA: the real volumes (default
# ../shared/data; without it those rows are left out); CACHE: where attenuation files lie while they are needed (default
# build/references); BUILD: default build/release. The largest cloud is LARGEST voxels an edge (default 1024: 1 GB on the
# disk, ten minutes to make; CLOUDS, a folder, keeps cloud_N.fvx from run to run).
set -euo pipefail
cd "$(dirname "$0")/.."
data=${DATA:-../shared/data}
cache=${CACHE:-build/references}
build=${BUILD:-build/release}
largest=${LARGEST:-1024}
out=docs/results/hierarchy
wanted=("$@")
[ ${#wanted[@]} -gt 0 ] || wanted=(levels refinement detail size pictures)

if [ ! -x "$build/bin/freevoxel_hierarchy" ]; then
  cmake --preset release -DFREEVOXEL_BENCH=ON
  cmake --build --preset release --parallel "$(nproc)"
fi
program=$build/bin/freevoxel
mkdir -p "$out"
measure() { # TABLE OPTIONS...
  local table=$1
  shift
  "$build/bin/freevoxel_hierarchy" "$table" --data "$data" --transfers examples/transfer --cache "$cache" "$@" \
    -o "$out/$table.table"
}

# The same cloud at doubling resolutions, with all levels.
clouds() {
  local folder=${CLOUDS:-$cache} n
  mkdir -p "$folder"
  for ((n = 256; n <= largest; n *= 2)); do
    local file=$folder/cloud_$n.fvx
    if [ ! -e "$file" ]; then
      "$program" generate cloud --dims "$n,$n,$n" -o "$folder/cloud_$n.nrrd" --quiet
      "$program" precompute "$folder/cloud_$n.nrrd" --transfer examples/transfer/cloud.json --layout compact --levels 0 \
        --memory 4G -o "$file" --quiet
      rm "$folder/cloud_$n.nrrd"
    fi
    printf '%s%s' "$([ "$n" = 256 ] || echo ,)" "$file"
  done
}

pictures() {
  local scratch name
  scratch=$(mktemp -d)
  local -a raw=("$data/volumes/cthead_256x256x113_uint16_be.raw.gz" --dims 256,256,113 --type u16 --endian big --spacing 1,1,2
    --transfer examples/transfer/cthead_coloured.json)
  [ -e "${raw[0]}" ] || return 0
  "$program" precompute "${raw[@]}" --layout compact --levels 0 -o "$scratch/head.fvx" --quiet
  local -a view=(--eye 300,-350,-60 --target 127,127,112 --up 0,0,-1 --fov 34)
  "$program" render "$scratch/head.fvx" "${view[@]}" --size 256x256 --progressive "$scratch/steps" -o "$scratch/last.png" --quiet
  "$program" sheet "$scratch"/steps/*.png --columns 6 -o "$out/refinement.png" --quiet
  for name in 0 1.5 3 6; do
    "$program" render "$scratch/head.fvx" "${view[@]}" --size 256x256 --lod "$name" -o "$scratch/lod$name.png" --quiet
  done
  "$program" sheet "$scratch"/lod{0,1.5,3,6}.png --columns 4 -o "$out/lod.png" --quiet
  rm -r "$scratch"
}

for part in "${wanted[@]}"; do
  case $part in
    levels) measure levels --columns cloud,shells,carp,cthead,cthead-coloured ;;
    refinement) measure refinement --columns cloud,shells,carp,cthead,cthead-coloured,cthead-opaque ;;
    detail) measure detail --columns cloud,cthead --size 512 ;;
    size)
      files=$(clouds)
      measure volume-size --files "$files"
      measure image-size --files "${files##*,}"
      ;;
    pictures) pictures ;;
    *) echo "expected levels, refinement, detail, size or pictures, found '$part'" >&2; exit 2 ;;
  esac
done

section() { # TABLE
  [ -e "$out/$1.table" ] && cat "$out/$1.table" || echo "Not measured yet."
}
cat > docs/results/hierarchy.md << TEXT
# Levels of detail

Written by \`scripts/bench_hierarchy.sh\`. PSNR in dB (peak 1, linear, covered pixels).

## What coarser levels are worth

Level k, a pixel to the longest edge of its voxels, one ray per pixel, against the finest level at 2^k times the size,
averaged over 2^k x 2^k pixels. Pooled over 4 random orthographic views, in brackets the worst. "Mean values": a volume of
half, a quarter and an eighth of the resolution, each value a mean of eight, classified after interpolation, as levels of
detail are made elsewhere; attenuation swept. "The finest": drawn with one ray per pixel of the small picture, which is what
sampling alone costs. Else attenuation as by default.

$(section levels)

## Refinement

\`Splatter::refine\` (\`render --progressive\`), 4 random views of 256 x 256, perspective, every picture against the last, which is
checked to be the direct picture bit for bit. "Fewest", "first" and "last but one" are the worst of the views, "largest fall"
is by how much a picture was ever farther from the last than the one before it.

$(section refinement)

![refinement of CThead, coloured](hierarchy/refinement.png)

## Frame time and PSNR over --lod

512 x 512, one view, the C++ backend, median of 5. Where all blocks are of the finest level the picture is that of \`--lod 0\`
to the last bit, though near fields are then traced brick by brick.

$(section detail)

![--lod 0, 1.5, 3 and 6](hierarchy/lod.png)

## Cost over the size of the volume

The same cloud at doubling resolutions, \`--lod 1\`, 256 x 256, median of 5, layout \`compact\`. Values, colours and opacities
of bricks stay in memory from frame to frame; attenuation is unpacked and looked up anew in every frame, as for a view that
moves. Ratios within a table count, not milliseconds.

$(section volume-size)

## Cost over the size of the image

The largest of these clouds, \`--lod 1\`: cost goes with the pixels, and with the bricks that they need.

$(section image-size)

TEXT
