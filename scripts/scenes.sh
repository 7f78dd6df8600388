#!/usr/bin/env bash
# Traces every scene of examples/scenes/ and writes the pictures and a table of what they took to a folder:
#   scripts/scenes.sh [FOLDER] [PROGRAM]      (docs/results/voxlink, build/release/bin/freevoxel)
# Needs the real data beside the checkout (../shared/data).
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-docs/results/voxlink}
program=${2:-build/release/bin/freevoxel}
mkdir -p "$folder"
statistics=$(mktemp -d)
trap 'rm -rf "$statistics"' EXIT

declare -A resolution=([glass_house]=512 [glass_bunny]=512 [dragon]=512 [halo]=384 [capsid]=384 [tea]=384 [two_heads]=384)
for scene in glass_house glass_bunny dragon halo capsid tea two_heads; do
  "$program" trace "examples/scenes/$scene.json" --resolution "${resolution[$scene]}" --backend cpu --quiet \
    -o "$folder/$scene.png" --stats "$statistics/$scene.json"
done

python3 - "$folder" "$statistics" <<'PYTHON' > "$folder/scenes.md"
import json, os, sys
folder, statistics = sys.argv[1:]
about = {
    "glass_house": "a house of 56,674 triangles, windows of glass",
    "glass_bunny": "the bunny of glass, a mirror, chequered walls",
    "dragon": "202,520 triangles",
    "halo": "32,314 particles of a dark matter halo",
    "capsid": "Norwalk virus, 60 copies of 11,284 atoms",
    "tea": "mesh, spheres and a volume (smoke) together",
    "two_heads": "one CT under two transfer functions, side by side",
}
print("# Scenes of examples/scenes\n")
print("Written by `scripts/scenes.sh`, plain C++ (`--backend cpu`), %d threads; the machine may have had other work."
      % json.load(open(os.path.join(statistics, "dragon.json")))["threads"])
print("Bytes per voxel count every buffer that tracing reads, spheres and materials among them. Seconds: reading files,")
print("building the buffers, shadows of volumes, tracing one picture.\n")
print("| scene | what | voxels along the longest edge | stored voxels | bytes per voxel | rays | read | build | shadows | trace |")
print("|---|---|---|---|---|---|---|---|---|---|")
for scene, what in about.items():
    done = json.load(open(os.path.join(statistics, scene + ".json")))
    command = done["command"].split()
    seconds = done["seconds"]
    print("| [%s](../../../examples/scenes/%s.json) | %s | %s | %s | %.1f | %s | %.1f | %.1f | %.1f | %.1f |" % (
        scene, scene, what, command[command.index("--resolution") + 1], f'{done["storedVoxels"]:,}',
        done["bytesPerStoredVoxel"], f'{done["rays"]:,}', seconds["read"], seconds["build"], seconds["shadows"],
        seconds["trace"]))
for scene, what in about.items():
    print(f"\n![{what}]({scene}.png)")
PYTHON
