#!/usr/bin/env bash
# The volume part of the VoxLink paper's evaluation (papers: section 6.2, Table 3, Figures 7 and 8) with our data:
#   scripts/reproduce_voxlink.sh build/release/bin/freevoxel DATA_FOLDER [OUT_FOLDER]
# DATA_FOLDER holds volumes/ and vdb/; docs/results/voxlink is the default for tables and figures. Frame rates are means
# over VIEWS views of a full turn about y and as many of one about x. Without a GPU the CPU backend traces few views.
#   PARTS="table3 steps lamps figures" names what to measure and draw, all of it by default;
#   VIEWS=360 RESOLUTIONS="256 512 1024" SIZE=1000x1000 BACKEND=gl override what it chooses.
data=$(realpath "$2")
. "$(dirname "$0")/voxlink_measuring.sh"
out=${3:-$top/docs/results/voxlink}
mkdir -p "$out"
views=${VIEWS:-$((few ? 2 : 360))}
resolutions=${RESOLUTIONS:-256 512$( ((few)) || echo " 1024")}
size=${SIZE:-1000x1000}
view=(--orbit 0,0 --fov 30)
part() { [[ " ${PARTS:-table3 steps lamps figures} " == *" $1 "* ]]; }

for r in $(printf '%s\n' 256 $resolutions | sort -nu); do
  for kind in kronecker sphere; do
    "$program" generate "$kind" --dims "$r,$r,$r" -o "$scratch/$kind$r.nrrd" --quiet
  done
done

measure() { # NAME RESOLUTION BRICK ARGUMENTS...
  local name=$1 resolution=$2 brick=$3
  shift 3
  echo "$name $resolution [$brick]" >&2
  trace "$@" --brick "$brick" --backend "$backend" --turn "$views" "${view[@]}" --size "$size"
  printf '| %s | %s [%s] | ' "$name" "$resolution" "$brick"
  echo "$(value storedVoxels) $(value voxels) $(value occupiedBricks) $(value bricks) $(value bufferBytes) \
    $(value bytesPerStoredVoxel) $(value framesPerSecond) $(value raysPerSecond) $(value build)" |
    awk '{printf "%.2f %% | %.1f %% | %.1f | %.1f | %.2f | %.2f | %.2f |\n",
      100 * $1 / $2, 100 * $3 / $4, $5 / 1048576, $6, $7, $8 / 1e6, $9}'
}
raw=$data/volumes
aneurism=("$raw/aneurism_256x256x256_uint8.raw.gz" --dims 256,256,256 --type u8 --transfer "$transfers/aneurism.json")
carp=("$raw/carp.nii.gz" --transfer "$transfers/carp.json" --threshold 0.1)
smoke=("$data/vdb/smoke.vdb" --transfer "$transfers/smoke.json")
table3() {
  local table=$out/table3.md
  {
    echo "Made by scripts/reproduce_voxlink.sh ($machine): $size, mean of $((2 * views)) views of full turns about y"
    echo "and x. Load average of the machine at the start: $(load) (of $(nproc) cores)."
    echo
    echo "The paper has $((2 * 360)) views on a Quadro K6000; its kingfisher and mouse are not public, so three other sparse"
    echo "volumes stand in for them, resampled."
    echo
    echo "| volume | resolution [brick] | non-empty voxels | non-empty bricks | memory, MiB | bytes per voxel | fps | Mray/s | build, s |"
    echo "|---|---|---|---|---|---|---|---|---|"
    echo "| *paper:* Kronecker | 512 [8] | 34.7 % | 39.7 % | 738.0 | 16.6 | 11.6 | 11.6 | |"
    echo "| *paper:* Kronecker | 1024 [8] | 34.6 % | 37.1 % | 5874.3 | 16.6 | 1.9 | 1.9 | 2.6 |"
    echo "| *paper:* Kingfisher | 1024 [8] | 0.5 % | 2.3 % | 107.6 | 19.6 | 35.4 | 35.4 | |"
    echo "| *paper:* Kingfisher | 1024 [16] | 0.5 % | 3.5 % | 97.9 | 17.8 | 21.0 | 21.0 | |"
    echo "| *paper:* Mouse | 1024 [8] | 1.7 % | 6.2 % | 322.3 | 18.2 | 15.9 | 15.9 | |"
    echo "| *paper:* Mouse | 1024 [16] | 1.7 % | 7.5 % | 302.8 | 17.1 | 8.4 | 8.4 | |"
  } >"$table"
  for r in $resolutions; do
    for brick in 4 8 16; do
      kronecker=("$scratch/kronecker$r.nrrd" --transfer "$transfers/kronecker.json")
      measure kronecker "$r" "$brick" "${kronecker[@]}"
      measure "carp, opacity above 0.1" "$r" "$brick" "${carp[@]}" --resolution "$r"
      measure aneurism "$r" "$brick" "${aneurism[@]}" --resolution "$r"
      measure smoke "$r" "$brick" "${smoke[@]}" --resolution "$r"
    done
  done >>"$table"
}

# Steps per pass: only the GPU's passes are bounded by them. On a software renderer a smaller picture.
steps() {
  small=$size
  ((few)) && small=250x250
  {
    echo "| steps per pass | passes | fps, kronecker 256 [8], $small |"
    echo "|---|---|---|"
    for n in 64 256 512 1024; do
      trace "$scratch/kronecker256.nrrd" --transfer "$transfers/kronecker.json" --backend gl --steps "$n" --turn "$views" "${view[@]}" --size "$small"
      printf '| %s | %s | %.2f |\n' "$n" "$(value passes)" "$(value framesPerSecond)"
    done
    echo
    echo "OpenGL here: $(value glRenderer)"
  } >"$out/steps.md"
}

# Lamps: frames of a turn, and what is done once for the lamps. Processors change their speed from minute to minute, so
# every round has a turn of each kind, and ratios are taken within a round. Rays, which take long, are in the first one.
lamps() {
  local rounds=${ROUNDS:-7} lamps whole how n shadows lit frame without
  lamps=(--light-direction=1,0.2,0.8 --light-direction=-1,0.5,0.3 --light-direction=0.2,1,0.3 --light-direction=0.2,-0.4,-1)
  whole=("$raw/carp.nii.gz" --transfer "$transfers/carp.json")
  {
    echo "The whole carp, $size, \`--shading phong\`: medians of $rounds interleaved rounds (rays: one) of $((4 * views)) views; $machine,"
    echo "load average $(load) at the start."
    echo
    echo "| lights | shadows | frame, s | of the frame without | once for the lamps, s |"
    echo "|---|---|---|---|---|"
    for ((round = 0; round < rounds; ++round)); do
      for how in "0 -" "1 attenuation" "2 attenuation" "3 attenuation" "4 attenuation" "1 rays" "4 rays"; do
        read -r n shadows <<<"$how"
        [[ $round -gt 0 && $shadows == rays ]] && continue
        lit=()
        ((n == 0)) || lit=(--shading phong --shadows "$shadows" "${lamps[@]:0:n}")
        trace "${whole[@]}" --backend "$backend" "${lit[@]}" --turn $((2 * views)) "${view[@]}" --size "$size"
        frame=$(value framesPerSecond | awk '{print 1 / $1}')
        ((n > 0)) || without=$frame
        echo "$n $shadows $frame $without $(value shadows)" | awk '{print $1, $2, $3, $3 / $4, $5}'
      done
    done | sort -k2,2 -k1,1n -k4,4g | awk '
      function tell() { m = int((count + 1) / 2); printf "| %s | %s | %.3f | %.2f | %.2f |\n", n, how, frame[m], ratio[m], once[m] }
      $1 != n || $2 != how { if (count) tell(); count = 0; n = $1; how = $2 }
      { ++count; frame[count] = $3; ratio[count] = $4; once[count] = $5 }
      END { tell() }'
  } >"$out/lights.md"
}

# Figure 7: how the frame rate depends on the angle, of a sphere, which looks the same from everywhere.
figures() {
  turn=${TURN:-$((views < 24 ? 12 : views))}
  if command -v gnuplot >/dev/null; then
    curves=()
    for r in $resolutions; do
      for brick in 4 8 16; do
        trace "$scratch/sphere$r.nrrd" --transfer "$transfers/sphere.json" --brick "$brick" --backend "$backend" --turn "$turn" \
          "${view[@]}" --size 400x400
        frames | awk -v n="$turn" '{print (NR - 1) * 360 / n, 1 / $1}' >"$scratch/sphere$r.$brick"
        curves+=("'$scratch/sphere$r.$brick' with linespoints title '$r [$brick]'")
      done
    done
    all=$(IFS=,; echo "${curves[*]}")
    gnuplot <<PLOT
set terminal pngcairo size 900,420
set output '$out/figure7.png'
set xlabel 'degrees about y, then about x'
set ylabel 'frames per second (400x400)'
set xrange [0:720]
set xtics 90
set key outside
plot $all
PLOT
  fi

  # Figure 8 and the shadows: pictures.
  picture=(--size 420x420)
  lit=(--shading phong --ambient 0.2)
  draw "$scratch/kronecker256.nrrd" --transfer "$transfers/kronecker.json" "${picture[@]}" --orbit 30,20 \
    -o "$scratch/kronecker.png"
  draw "${carp[@]}" "${picture[@]}" --eye 760,340,420 --up 0,0,1 --fov 40 "${lit[@]}" --light-direction=1,0.2,0.8 \
    -o "$scratch/carp.png"
  draw "${aneurism[@]}" "${picture[@]}" --orbit 25,15 --fov 20 "${lit[@]}" --light-direction=0,1,1 -o "$scratch/aneurism.png"
  draw "${smoke[@]}" "${picture[@]}" --orbit 30,10 --light-direction=1,0.6,0.3 --ambient 0.3 -o "$scratch/smoke.png"
  "$program" sheet "$scratch"/{kronecker,carp,aneurism,smoke}.png --columns 4 -o "$out/figure8.png"
  for shadows in none attenuation rays; do
    draw "${smoke[@]}" "${picture[@]}" --orbit 30,10 --light-direction=1,0.6,0.3 --ambient 0.3 --shadows "$shadows" \
      -o "$scratch/shadows_$shadows.png"
  done
  "$program" sheet "$scratch"/shadows_{none,attenuation,rays}.png --columns 3 -o "$out/shadows.png"
}

for what in table3 steps lamps figures; do
  if part "$what"; then "$what"; fi
done
echo "tables and figures: $out"
