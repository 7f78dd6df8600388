#!/usr/bin/env bash
# Kills one of four ranks in the middle of a frame, 20 times, and tells how long the job lasted after that, whether it failed
# with a message, and what it left:
#   scripts/kill_ranks.sh build/release/bin/freevoxel [runs]
# Exit status 0 if every job ended within 10 seconds, with a message, without a broken picture, and without a temporary file
# that the next picture of that name does not remove: nobody else can remove what the killed rank was writing.
set -euo pipefail
program=$(realpath "$1")
runs=${2:-20}
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"$program" generate cloud --dims 96,80,72 -o a.nrrd
echo '{"range": [0, 255], "points": [{"value": 0, "color": [1, 1, 1], "opacity": 0.0},
       {"value": 255, "color": [1, 1, 1], "opacity": 0.5}]}' >t.json
"$program" precompute a.nrrd --transfer t.json -o a.fvx

good=0 longest=0
for ((run = 0; run < runs; ++run)); do
  # Far more frames than there is time for.
  mpirun -n 4 "$program" render a.fvx -o p.exr --size 1500x1100 --frames 2000 --quiet >out 2>talk &
  job=$!
  ranks=()
  for ((wait = 0; wait < 300 && ${#ranks[@]} < 4; ++wait)); do
    sleep 0.1
    mapfile -t ranks < <(pgrep -P "$job" || true)
  done
  # Another rank and another moment each time; frames are written by then, or about to be.
  for ((wait = 0; wait < 300; ++wait)); do
    [[ -e p_0000.exr ]] && break
    sleep 0.1
  done
  sleep "0.$((run * 7 % 10))"
  victim=${ranks[$((run % 4))]}
  start=$(date +%s%N)
  kill -KILL "$victim"
  status=0
  wait "$job" || status=$?
  milliseconds=$((($(date +%s%N) - start) / 1000000))
  ((milliseconds > longest)) && longest=$milliseconds
  message=$(grep -c "exited on signal 9" talk || true)
  # Frames that are there must be whole.
  broken=0
  for picture in p_*.exr; do
    "$program" compare "$picture" "$picture" --identical >/dev/null 2>&1 || broken=$((broken + 1))
  done
  partial=0
  for temporary in $(find . -name '.p_*.exr' -printf '%f '); do
    partial=$((partial + 1))
    picture=$(sed 's/^\.\(p_[0-9]*\).*/\1/' <<<"$temporary").exr
    "$program" render a.fvx -o "$picture" --size 8x6 --quiet
  done
  left=$(find . -name '.p*' | wc -l)
  echo "run $run: rank $((run % 4)) killed, job ended after $milliseconds ms, status $status, message $message, partial $partial, of these not removed $left, broken $broken"
  if ((status != 0 && milliseconds < 10000 && message > 0 && left == 0 && broken == 0)); then good=$((good + 1)); fi
  rm -f p_*.exr
done
echo "$good of $runs jobs ended well, the longest after $longest ms"
((good == runs))
