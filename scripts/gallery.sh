#!/usr/bin/env bash
# A picture of every real volume, with the transfer functions of examples/transfer/, and all of them on one sheet:
#   scripts/gallery.sh build/release/bin/freevoxel DATA_FOLDER [OUT_FOLDER]
# DATA_FOLDER holds volumes/ and vdb/; out/gallery is the default for pictures.
set -euo pipefail
program=$(realpath "$1")
data=$(realpath "$2")
out=${3:-out/gallery}
size=${GALLERY_SIZE:-480x480}
transfers=$(cd "$(dirname "$0")/../examples/transfer" && pwd)
mkdir -p "$out"

# The options of a camera that sees the whole box from a direction, with what is up in the picture.
camera() { # FILE-AND-OPTIONS DIRECTION UP
  local -a volume
  read -ra volume <<<"$1"
  "$program" info --json "${volume[@]}" | tr -d ' \n' |
    sed 's/.*"bounds":\[\[\([^]]*\)\],\[\([^]]*\)\]\].*/\1,\2/' |
    awk -F, -v direction="$2" -v up="$3" '{
      split(direction, d, ","); length_d = sqrt(d[1]^2 + d[2]^2 + d[3]^2)
      radius = 0.5 * sqrt(($4-$1)^2 + ($5-$2)^2 + ($6-$3)^2)
      for (i = 1; i <= 3; ++i) eye[i] = ($i + $(i+3)) / 2 + 3.4 * radius * d[i] / length_d
      printf "--eye %.6g,%.6g,%.6g --up %s", eye[1], eye[2], eye[3], up }'
}

pictures=()
draw() { # NAME FILE-AND-OPTIONS TRANSFER DIRECTION UP [MORE-OPTIONS]
  local -a volume view more
  read -ra volume <<<"$2"
  read -ra view <<<"$(camera "$2" "$4" "$5")"
  read -ra more <<<"${6:-}"
  echo "$1"
  "$program" render "${volume[@]}" --transfer "$transfers/$3" "${view[@]}" "${more[@]}" --size "$size" \
    --quiet --background '#0b0d12' -o "$out/$1.png"
  pictures+=("$out/$1.png")
}

raw=$data/volumes
draw cthead "$raw/cthead_256x256x113_uint16_be.raw.gz --dims 256,256,113 --type u16 --endian big --spacing 1,1,2" \
  cthead.json -0.6,-1,-0.3 0,0,-1 "--fov 25 --shading phong --light-direction -1,-0.7,-1 --ambient 0.35"
draw headsq "$raw/headsq/quarter.nhdr" headsq.json -0.6,-1,-0.3 0,0,-1 \
  "--fov 26 --shading phong --light-direction -1,-0.7,-1 --ambient 0.35"
draw dicom_t1w "$raw/dicom_t1w" dicom_t1w.json -0.9,0.35,0.1 0,0,1 \
  "--fov 24 --light-direction -0.5,0.3,1 --ambient 0.6"
draw brain "$raw/brain_ch256.nii.gz" brain.json -0.8,0.8,0.6 0,0,1 \
  "--fov 24 --shading phong --light-direction -1,0.2,1.2 --ambient 0.3"
draw avg152 "$raw/avg152T1_RL_bigendian.nii.gz" avg152.json 0.25,-0.35,-1 0,1,0 \
  "--fov 26 --shading lambert --light-direction -0.6,0.7,-1 --ambient 0.5"
draw carotid "$raw/carotid.vtk" carotid.json 0.3,-1,0.2 0,0,1 \
  "--fov 30 --shading phong --light-direction 0.2,-1,1 --ambient 0.4"
draw aneurism "$raw/aneurism_256x256x256_uint8.raw.gz --dims 256,256,256 --type u8" aneurism.json 0.5,0.3,1 0,1,0 \
  "--fov 20 --shading phong --light-direction 0,1,1 --ambient 0.3"
draw stent "$raw/stent.nrrd" stent.json 0.4,-1,0.15 0,0,1 \
  "--fov 31 --shading phong --light-direction 1,-1,0.6 --ambient 0.4"
draw carp "$raw/carp.nii.gz" carp.json 1,0.25,0.35 0,0,1 \
  "--fov 29 --shading phong --light-direction 1,0.2,0.8 --ambient 0.35"
draw embryo "$raw/embryo_256x256x256_uint8.raw.gz --dims 256,256,256 --type u8" embryo.json 0.5,0.4,1 0,1,0 \
  "--fov 15 --shading phong --light-direction -0.2,1,0.8 --ambient 0.3"
draw frogtissue "$raw/frogtissue/frogtissue.mhd --labels" frogtissue.json 0.2,-0.5,-1 0,-1,0 \
  "--fov 27 --light-direction -0.7,-0.5,-0.8 --ambient 0.35"
draw hydrogen "$raw/hydrogen_atom_128x128x128_uint8.raw.gz --dims 128,128,128 --type u8" hydrogen.json 1,0.35,0.45 \
  0,0,1 "--fov 20"
draw neghip "$raw/neghip.mha" neghip.json 0.6,0.4,1 0,1,0 "--fov 22"
draw nucleon "$raw/nucleon/nucleon.dat" nucleon.json 0.6,0.4,1 0,1,0 "--fov 22"
draw vorticity "$raw/vorticity_128x128x41_float32_le.raw.gz --dims 128,128,41 --type f32" vorticity.json 0.3,-0.6,1 \
  0,1,0 "--fov 26 --light-direction -0.5,-0.3,1 --ambient 0.5"
draw smoke "$data/vdb/smoke.vdb" smoke.json 0.5,0.15,1 0,1,0 "--fov 30 --light-direction 1,0.6,0.3 --ambient 0.35"
draw sphere "$data/vdb/sphere.vdb" vdb_sphere.json 0.5,0.4,1 0,1,0 \
  "--fov 24 --shading phong --light-direction -0.6,1,0.9 --ambient 0.2"

"$program" sheet "${pictures[@]}" --columns 6 -o "$out/sheet.png"
echo "the sheet: $out/sheet.png"
