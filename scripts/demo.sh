#!/usr/bin/env bash
# From a clean clone to a picture: builds freevoxel, makes a cloud, renders it and measures the picture.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install_dependencies.sh
cmake --preset release >/dev/null
cmake --build --preset release --parallel "$(nproc)" --target freevoxel

freevoxel=build/release/bin/freevoxel
transfer=examples/transfer/nebula.json
view=(--orbit "30,22,540" --fov 20 --size 1000x700)
mkdir -p out

echo "a cloud of 240 x 192 x 144 voxels, its attenuation along 26 directions, a picture of it"
"$freevoxel" generate cloud --dims 240,192,144 -o out/cloud.nrrd
"$freevoxel" precompute out/cloud.nrrd --transfer "$transfer" -o out/cloud.fvx
"$freevoxel" render out/cloud.fvx "${view[@]}" --background '#05060f' -o out/demo.png

echo "the same view, linear, against a ray caster"
"$freevoxel" render out/cloud.fvx "${view[@]}" -o out/splats.exr
"$freevoxel" render out/cloud.nrrd --transfer "$transfer" --formula raycast --step 0.5 "${view[@]}" -o out/reference.exr
"$freevoxel" compare out/splats.exr out/reference.exr

echo "the picture: $PWD/out/demo.png"
