#!/usr/bin/env bash
# What both layouts take on every real volume, and how far apart their pictures are, as docs/results/attenuation_sizes.md:
#   scripts/attenuation_sizes.sh build/release/bin/freevoxel DATA_FOLDER > docs/results/attenuation_sizes.md
# DATA_FOLDER holds volumes/ and vdb/. Files are made in a temporary folder, one after another.
set -euo pipefail
program=$(realpath "$1")
data=$(realpath "$2")
transfers=$(cd "$(dirname "$0")/../examples/transfer" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

number() { # KEY JSON-FILE
  sed -n "s/.*\"$1\": *\([0-9.eE+-]*\).*/\1/p" "$2" | head -n 1
}

cat <<'TEXT'
# What attenuation takes

Bytes per voxel of the volume, directories and transfer function left out; written by `scripts/attenuation_sizes.sh`,
with the transfer functions of `examples/transfer/`, `preintegrated` (labels: `voxel`). *Occupied*: voxels in stored
bricks of 16^3. *Levels*: all coarser ones together (`--levels 0`), *pin*: one direction (`--pin-direction 1,1,1`); both
are the same in either layout. *Apart*: PSNR in dB between pictures from `dense` and from `compact` with bricks of 16^3,
formula `direct`, 500 x 400, `--orbit 40,25`.

| volume | voxels | occupied | attenuation dense 16 | compact 16 | compact 32 | values dense 16 | compact 16 | compact 32 | levels 16 | 32 | pin 16 | 32 | apart |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
TEXT

row() { # NAME FILE-AND-OPTIONS TRANSFER
  local -a volume
  read -ra volume <<<"$2"
  local layout edge name
  for name in dense-16 compact-16 compact-32; do
    layout=${name%-*} edge=${name#*-}
    "$program" precompute "${volume[@]}" --transfer "$transfers/$3" --layout "$layout" --brick "$edge" --quiet \
      --levels 0 --pin-direction 1,1,1 -o "$folder/$name.fvx"
    "$program" info --json "$folder/$name.fvx" >"$folder/$name.json"
  done
  for layout in dense compact; do
    "$program" render "$folder/$layout-16.fvx" --formula direct --size 500x400 --orbit 40,25 --quiet \
      -o "$folder/$layout.exr"
  done
  "$program" compare --json "$folder/dense.exr" "$folder/compact.exr" >"$folder/compare.json" || true
  local apart
  apart=$(number psnr "$folder/compare.json")
  grep -q '"identical": true' "$folder/compare.json" && apart=identical
  awk -v name="$1" -v apart="$apart" \
    -v dims="$(tr -d ' \n' <"$folder/dense-16.json" | sed 's/.*"dims":\[\([0-9,]*\)\].*/\1/; s/,/ x /g')" \
    -v occupancy="$(number occupancy "$folder/dense-16.json")" \
    -v a="$(number attenuationBytesPerVoxel "$folder/dense-16.json")" \
    -v b="$(number attenuationBytesPerVoxel "$folder/compact-16.json")" \
    -v c="$(number attenuationBytesPerVoxel "$folder/compact-32.json")" \
    -v d="$(number valueBytesPerVoxel "$folder/dense-16.json")" \
    -v e="$(number valueBytesPerVoxel "$folder/compact-16.json")" \
    -v f="$(number valueBytesPerVoxel "$folder/compact-32.json")" \
    -v g="$(number levelBytesPerVoxel "$folder/compact-16.json")" \
    -v h="$(number levelBytesPerVoxel "$folder/compact-32.json")" \
    -v i="$(number pinBytesPerVoxel "$folder/compact-16.json")" \
    -v j="$(number pinBytesPerVoxel "$folder/compact-32.json")" 'BEGIN {
      if (apart + 0 > 0) apart = sprintf("%.1f", apart)
      printf "| %s | %s | %.1f %% | %.2f | %.3f | %.3f | %.2f | %.3f | %.3f | %.3f | %.3f | %.3f | %.3f | %s |\n",
        name, dims, 100 * occupancy, a, b, c, d, e, f, g, h, i, j, apart }'
  rm -f "$folder"/*.fvx
}

raw=$data/volumes
row carp "$raw/carp.nii.gz" carp.json
row aneurism "$raw/aneurism_256x256x256_uint8.raw.gz --dims 256,256,256 --type u8" aneurism.json
row embryo "$raw/embryo_256x256x256_uint8.raw.gz --dims 256,256,256 --type u8" embryo.json
row CThead "$raw/cthead_256x256x113_uint16_be.raw.gz --dims 256,256,113 --type u16 --endian big --spacing 1,1,2" \
  cthead.json
row brain "$raw/brain_ch256.nii.gz" brain.json
row headsq "$raw/headsq/quarter.nhdr" headsq.json
row "DICOM head" "$raw/dicom_t1w" dicom_t1w.json
row avg152 "$raw/avg152T1_RL_bigendian.nii.gz" avg152.json
row carotid "$raw/carotid.vtk" carotid.json
row stent "$raw/stent.nrrd" stent.json
row frogtissue "$raw/frogtissue/frogtissue.mhd --labels" frogtissue.json
row hydrogen "$raw/hydrogen_atom_128x128x128_uint8.raw.gz --dims 128,128,128 --type u8" hydrogen.json
row neghip "$raw/neghip.mha" neghip.json
row nucleon "$raw/nucleon/nucleon.dat" nucleon.json
row vorticity "$raw/vorticity_128x128x41_float32_le.raw.gz --dims 128,128,41 --type f32" vorticity.json
row smoke "$data/vdb/smoke.vdb" smoke.json
row sphere "$data/vdb/sphere.vdb" vdb_sphere.json
