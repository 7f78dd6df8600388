#!/usr/bin/env bash
# The part of the VoxLink paper's evaluation that has surfaces (papers: sections 5.2.1, 6.1 and 6.3, Tables 1 and 2,
# Figures 5 to 7), with the scenes of examples/scenes:
#   scripts/reproduce_voxlink_scenes.sh build/release/bin/freevoxel [OUT_FOLDER]
# docs/results/voxlink is the default. Frame rates are means over VIEWS views of a full turn about y and as many of one
# about x. Without a GPU the CPU backend traces few and small views; the tables say so.
#   PARTS="table1 table2 steps weights figures" names what to measure and draw, all of it by default;
#   VIEWS=360 RESOLUTIONS="256 512 1024" SIZE=1000x1000 BACKEND=gl override what it chooses.
. "$(dirname "$0")/voxlink_measuring.sh"
out=${2:-$top/docs/results/voxlink}
mkdir -p "$out"
views=${VIEWS:-$((few ? 2 : 360))}
resolutions=${RESOLUTIONS:-256 512$( ((few)) || echo " 1024")}
size=${SIZE:-$( ((few)) && echo 250x250 || echo 1000x1000)}
printf 'x,y,z,radius\n0,0,0,1\n' >"$scratch/sphere.csv"
turned="$machine, $size, mean of $((2 * views)) views of full turns about y and x, load average of $(nproc) cores at the
start: $(load)"

part() { [[ " ${PARTS:-table1 table2 steps weights figures} " == *" $1 "* ]]; }

row() { # of the last trace: voxels, bricks, memory, bytes a voxel, frames and rays
  echo "$(value storedVoxels) $(value occupiedBricks) $(value bricks) $(value bufferBytes) \
    $(value bytesPerStoredVoxel) $(value framesPerSecond)" |
    awk '{printf "%.1f | %.1f %% | %.1f | %.1f | %.2f |\n", $1 / 1000, 100 * $2 / $3, $4 / 1048576, $5, $6}'
}

table1() {
  {
    echo "Made by scripts/reproduce_voxlink_scenes.sh: $turned. The paper: 1000x1000, 720 views, a Quadro K6000; its meshes"
    echo "are other cuts of the same models and its materials are not told."
    echo
    echo "| scene | render mode | resolution [brick] | voxels (1000) | non-empty bricks | memory, MiB | bytes a voxel | fps |"
    echo "|---|---|---|---|---|---|---|---|"
    for line in "Dragon|plain|256 [8]|81.6|5.0 %|9.4|121|307.8" "Dragon|plain|512 [8]|326.2|2.6 %|70.0|225|134.5" \
      "Dragon|ray tracing|256 [8]|81.6|5.0 %|9.4|121|47.6" "Dragon|ray tracing|512 [8]|326.2|2.6 %|70.0|225|39.6" \
      "House|ray tracing|256 [8]|560.0|18.8 %|16.7|31|45.2" "House|ray tracing|512 [8]|2319.3|12.2 %|100.0|45|38.8" \
      "Bunny|ray tracing|256 [8]|139.2|6.9 %|10.2|77|37.3" "Bunny|ray tracing|512 [8]|557.3|3.6 %|73.5|138|26.4"; do
      echo "| *paper:* ${line//|/ | } |"
    done
    for r in $resolutions; do
      brick=$((r >= 1024 ? 16 : 8))
      for mode in "dragon plain" "dragon ray tracing" "glass_house ray tracing" "glass_bunny ray tracing"; do
        name=${mode%% *}
        how=(--shadows rays)
        [[ $mode == *plain ]] && how=(--shadows none --max-depth 0)
        trace "$scenes/$name.json" --resolution "$r" --brick "$brick" --backend "$backend" "${how[@]}" --size "$size" \
          --turn "$views"
        echo "| $name | ${mode#* } | $r [$brick] | $(row)"
      done
    done
  } >"$out/table1.md"
}

table2() {
  {
    echo "Voxelised anew for every frame and traced: frames per second ($turned)."
    echo
    echo "| scene | resolution | brick 4 | brick 8 | brick 16 |"
    echo "|---|---|---|---|---|"
    echo "| *paper:* Dragon | 256 | 132.1 | 157.1 | 159.1 |"
    echo "| *paper:* House | 256 | 29.4 | 29.6 | 29.5 |"
    echo "| *paper:* Bunny | 256 | 20.5 | 21.0 | 20.7 |"
    echo "| *paper:* Dragon | 512 | 62.1 | 76.5 | 81.1 |"
    echo "| *paper:* House | 512 | 6.1 | 6.2 | 6.3 |"
    echo "| *paper:* Bunny | 512 | 4.8 | 4.9 | 4.9 |"
    for r in $resolutions; do
      for name in dragon glass_house glass_bunny; do
        cells=
        for brick in 4 8 16; do
          trace "$scenes/$name.json" --resolution "$r" --brick "$brick" --backend "$backend" --size "$size" \
            --turn "$views" --revoxelise
          cells+="$(value framesPerSecond | awk '{printf "%.2f", $1}') | "
        done
        echo "| $name | $r | $cells"
      done
    done
  } >"$out/table2.md"
}

# Steps per pass matter on the GPU only: a pass ends for a ray after so many, and rays that are not through go on in the
# next one.
steps() {
  local small=$size name n cells
  ((few)) && small=120x120
  {
    echo "Frames per second, in brackets the passes of a frame: resolution 256 [8], $small, 2 views, OpenGL:"
    echo "$(trace "$scenes/dragon.json" --resolution 32 --backend gl --size 16x16; value glRenderer)."
    echo
    echo "| scene | 32 steps per pass | 256 | 512 | 1024 |"
    echo "|---|---|---|---|---|"
    for name in dragon glass_house glass_bunny; do
      cells=
      for n in 32 256 512 1024; do
        trace "$scenes/$name.json" --resolution 256 --backend gl --steps "$n" --size "$small" --turn 1
        cells+="$(value framesPerSecond | awk '{printf "%.2f", $1}') ($(value passes)) | "
      done
      echo "| $name | $cells"
    done
  } >"$out/scene_steps.md"
}

# Figure 5: voxel A splits a ray into one that meets B and one that meets C. The scene has one pixel; all colours are
# black but one, so what the pixel shows is that one's weight.
quad() { # FILE.ply CORNER EDGE EDGE
  awk -v corner="$2" -v first="$3" -v second="$4" 'BEGIN {
    split(corner, p); split(first, u); split(second, v)
    print "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z"
    print "element face 1\nproperty list uchar int vertex_indices\nend_header"
    for (i = 0; i < 4; ++i) {
      s = i == 1 || i == 2
      t = i >= 2
      print p[1] + s * u[1] + t * v[1], p[2] + s * u[2] + t * v[2], p[3] + s * u[3] + t * v[3]
    }
    print "4 0 1 2 3" }' >"$scratch/$1"
}
shineOnly() { # a|b|c|none: writes NAME.exr
  local voxel colour materials=
  for voxel in a b c; do
    colour=$([[ $voxel == "$1" ]] && echo "[1, 1, 1]" || echo "[0, 0, 0]")
    materials+="\"$voxel\": {\"color\": $colour"
    [[ $voxel == a ]] && materials+=', "kind": "glass", "opacity": 0.5, "reflectance": 0.3, "indexOfRefraction": 1'
    materials+="},"
  done
  cat >"$scratch/split.json" <<JSON
{"meshes": [{"file": "a.ply", "material": "a"}, {"file": "b.ply", "material": "b"}, {"file": "c.ply", "material": "c"}],
 "materials": {${materials%,}}}
JSON
  draw "$scratch/split.json" --resolution 40 --eye 0,0,20 --target 0,0,0 --fov 1 --size 1x1 -o "$scratch/$1.exr"
}
weights() {
  local line voxel formula
  quad a.ply "-2 -2 2" "4 0 -4" "0 4 0"
  quad b.ply "-3 -3 -5" "6 0 0" "0 6 0"
  quad c.ply "5 -3 3" "0 0 -6" "0 6 0"
  shineOnly none
  {
    echo "Figure 5 of the paper: a ray is split in voxel A (alpha' = 0.5), 0.3 of what is left goes to C, the rest to B behind A."
    echo
    echo "| voxel | weight of its colour, traced | section 5.2.1 |"
    echo "|---|---|---|"
    for line in "a|alpha' = 0.5" "b|(1 - 0.3) (1 - alpha') = 0.35" "c|0.3 (1 - alpha') = 0.15"; do
      IFS='|' read -r voxel formula <<<"$line"
      shineOnly "$voxel"
      "$program" compare "$scratch/$voxel.exr" "$scratch/none.exr" --json |
        awk -v name="${voxel^^}" -v formula="$formula" \
          '/"maxError"/ {printf "| %s | %.6f | %s |\n", name, $2 + 0, formula}'
    done
  } >"$out/figure5.md"
}

figures() {
  # Figure 6: the three scenes.
  for name in dragon glass_house glass_bunny; do
    draw "$scenes/$name.json" --resolution 512 --size 480x360 -o "$scratch/$name.png"
  done
  "$program" sheet "$scratch"/{dragon,glass_house,glass_bunny}.png --columns 3 -o "$out/figure6.png"

  # Figure 7: how the frame rate depends on the angle, of one implicit sphere.
  turn=${TURN:-$((views < 12 ? 12 : views))}
  if command -v gnuplot >/dev/null; then
    curves=()
    for r in $resolutions; do
      for brick in 4 8 16; do
        trace "$scratch/sphere.csv" --resolution "$r" --brick "$brick" --backend "$backend" --turn "$turn" --size "$size"
        frames | awk -v n="$turn" '{print (NR - 1) * 360 / n, 1 / $1}' >"$scratch/sphere$r.$brick"
        curves+=("'$scratch/sphere$r.$brick' with linespoints title '$r [$brick]'")
      done
    done
    all=$(IFS=,; echo "${curves[*]}")
    gnuplot <<PLOT
set terminal pngcairo size 900,420
set output '$out/figure7_sphere.png'
set xlabel 'degrees about y, then about x'
set ylabel 'frames per second ($size)'
set xrange [0:720]
set xtics 90
set key outside
plot $all
PLOT
  fi
}

for what in table1 table2 steps weights figures; do
  if part "$what"; then "$what"; fi
done
echo "tables and figures: $out"
