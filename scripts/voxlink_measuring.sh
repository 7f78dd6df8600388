# What the reproduce_voxlink scripts share; to be sourced with the program as $1. Sets
#   program top out transfers scenes scratch      paths; scratch goes when the script ends
#   backend machine                               what traces, and what to say of it
#   few                                           1 where views have to be few, since there is no GPU
# and defines trace, draw, value, frames and load.
set -euo pipefail
program=$(realpath "$1")
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
transfers=$top/examples/transfer
scenes=$top/examples/scenes
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

value() { # KEY of the last statistics
  sed -n "s/^ *\"$1\": \"\(.*\)\",\{0,1\}$/\1/p; s/^ *\"$1\": \([^\",]*\),\{0,1\}$/\1/p" "$scratch/stats.json" | head -n 1
}
frames() { # seconds of every frame, one a line
  sed -n '/"frameSeconds"/,/\]/s/^ *\([0-9][0-9.e-]*\),\{0,1\}$/\1/p' "$scratch/stats.json"
}
trace() { # arguments of freevoxel trace
  "$program" trace --quiet --stats "$scratch/stats.json" -o "$scratch/picture.png" "$@"
}
draw() { # arguments of freevoxel trace, -o among them
  "$program" trace --quiet --backend "$backend" "$@"
}
load() { # how busy the machine is
  cut -d ' ' -f 1 /proc/loadavg
}

# Whether there is a GPU.
"$program" generate cloud --dims 24,20,28 -o "$scratch/probe.nrrd" --quiet
trace "$scratch/probe.nrrd" --transfer "$transfers/cloud.json" --size 32x32
backend=${BACKEND:-$(value backend)}
if [[ $backend == gl ]]; then
  few=0
  machine=$(value glRenderer)
else
  few=1
  machine="no GPU: plain C++ on $(value threads) threads, few views"
fi
