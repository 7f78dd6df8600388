#!/usr/bin/env bash
# Precomputes a procedural volume of 1024^3 bytes to layout `compact` where no more than as many bytes of memory may be
# had, and once more without a limit; the two files must be the same, byte by byte, but for the command they name.
# Prints a table:
#   scripts/larger_than_memory.sh build/release/bin/freevoxel [VOLUME.nrrd] > docs/results/precompute/larger_than_memory.md
# Takes about 8 minutes on two cores, 1.5 GB of disk (in TMPDIR) and, for the run without a limit, some 4 GB of memory.
# The volume (freevoxel generate cloud --dims 1024,1024,1024) is made unless it is given.
set -euo pipefail
program=$(realpath "$1")
given=${2:+$(realpath "$2")}
cd "$(dirname "$0")/.."
edge=1024
limit=$((edge * edge * edge))
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if [[ $(stat -f -c %T "$folder") == tmpfs ]]; then
  echo "larger_than_memory: $folder lies in memory; set TMPDIR to a folder on disk" >&2
  exit 1
fi

volume=${given:-$folder/cloud.nrrd}
[[ -n $given ]] || "$program" generate cloud --dims "$edge,$edge,$edge" -o "$volume" --quiet

most() { # KEY FILE: the largest figure of a key in copies of /proc/PID/status, kB
  awk -v key="$1:" '$1 == key && $2 > most { most = $2 } END { print most + 0 }' "$2"
}
number() { # KEY JSON-FILE
  sed -n "s/.*\"$1\": *\([0-9.]*\).*/\1/p" "$2" | head -n 1
}

run() { # NAME COMMAND...: what the process has, looked at five times a second
  local name=$1
  shift
  "$@" --transfer examples/transfer/cloud.json --layout compact --quiet -o "$folder/$name.fvx" \
    --stats "$folder/$name.json" &
  local process=$!
  : >"$folder/$name.status"
  while kill -0 "$process" 2>/dev/null; do
    cat "/proc/$process/status" >>"$folder/$name.status" 2>/dev/null || true
    sleep 0.2
  done
  wait "$process"
}

run limited prlimit --data="$limit" "$program" precompute "$volume" --memory "$limit"
run unlimited "$program" precompute "$volume"

# docs/format.md: every section but the command, which names the options.
sections() { # FILE: type, offset and bytes of each
  od -A n -v -t u8 -w40 -j 32 -N $((40 * $(od -A n -t u4 -j 12 -N 4 "$1"))) "$1" | awk '{ print $1 % 4294967296, $2, $3 }'
}
command=$((0x444e4d43)) # CMND
paste -d ' ' <(sections "$folder/limited.fvx") <(sections "$folder/unlimited.fvx") |
  while read -r type offset bytes otherType otherOffset otherBytes; do
    [[ $type == "$otherType" ]]
    [[ $type != "$command" ]] || continue
    [[ $bytes == "$otherBytes" ]]
    cmp -n "$bytes" -i "$offset:$otherOffset" "$folder/limited.fvx" "$folder/unlimited.fvx"
  done
"$program" verify "$folder/limited.fvx" --quiet >&2
if [[ $(most RssShmem "$folder/limited.status") != 0 ]]; then
  echo "larger_than_memory: shared memory was used" >&2
  exit 1
fi

cat <<TEXT
# Larger than memory

Written by \`scripts/larger_than_memory.sh\`: a cloud of ${edge}^3 bytes to layout \`compact\`, under
\`prlimit --data=$limit\` with \`--memory $limit\`, and without a limit. The two files are the same, byte by
byte, but for the command that they name, and \`verify\` accepts them. *Data*: the most private memory claimed (VmData),
*resident*: the most in memory at once, without the page cache (RssAnon), *shared*: anonymous shared memory (RssShmem);
looked at five times a second.

| run | seconds | data, MB | resident, MB | shared, MB | file, MB |
|---|---:|---:|---:|---:|---:|
TEXT
for name in limited unlimited; do
  awk -v name="$name" -v seconds="$(number total "$folder/$name.json")" -v bytes="$(stat -c %s "$folder/$name.fvx")" \
    -v data="$(most VmData "$folder/$name.status")" -v resident="$(most RssAnon "$folder/$name.status")" \
    -v shared="$(most RssShmem "$folder/$name.status")" 'BEGIN {
      printf "| %s | %.0f | %.0f | %.0f | %.0f | %.1f |\n", name, seconds, data * 1.024e-3, resident * 1.024e-3,
        shared * 1.024e-3, bytes * 1e-6 }'
done
