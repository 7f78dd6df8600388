#!/usr/bin/env bash
# Prints docs/commands.md as the program's own --help tells it:
#   scripts/write_command_docs.sh build/release/bin/freevoxel > docs/commands.md
set -euo pipefail
program=$1

cat <<'TEXT'
# Commands

What `freevoxel --help` and `freevoxel COMMAND --help` print; written by `scripts/write_command_docs.sh`, and a test
compares the two. Data go to stdout, everything said to the user goes to stderr.
TEXT

section() {
  printf '\n## %s\n\n```\n' "$1"
  shift
  "$program" "$@" --help
  printf '```\n'
}

section freevoxel
for command in generate precompute transfer info verify render trace compare sheet speedup; do
  section "$command" "$command"
done

cat <<'TEXT'

## Statistics

Every command takes `--stats FILE.json` and writes what it did; of these keys those that apply:

| key | meaning |
|---|---|
| `command`, `version` | the command as typed; the program's version |
| `seconds` | one entry per stage, and `total` |
| `threads` | that the program could use |
| `backend`, `glRenderer` | what drew the splats: `gl` or `cpu`; what OpenGL calls itself |
| `voxels`, `storedVoxels`, `visibleVoxels` | of the volume; in stored bricks; with opacity above 0 |
| `nonFinite` | values that are NaN or infinite |
| `fileBytes`, `bytesPerVoxel` | of the file read or written; divided by `voxels` |
| `largestValueError` | by coding values as whole numbers, in data units |
| `blocks`, `culledBlocks` | drawn (precompute: stored); outside the view |
| `splats`, `culledSplats`, `fragments` | drawn; without a pixel; pixels that splats covered |
| `quantum`, `passes` | what sums are multiples of; how often the picture was drawn until the sums proved exact; of `trace`, passes of bounded steps |
| `bricks`, `occupiedBricks` | of `trace`: of the grid over the stored voxels; with a stored voxel |
| `bufferBytes`, `bytesPerStoredVoxel` | of `trace`: of all buffers that rays read without lamps; divided by `storedVoxels` |
| `rays`, `storedFragments` | of `trace` with meshes, spheres or several objects: traced for the picture; what is in stored voxels |
| `nonFiniteVertices`, `nonFiniteTriangles`, `degenerateTriangles`, `linesAndPoints`, `nonFiniteSpheres`, `spheresWithoutRadius` | of the same: left out of what files hold |
| `builds` | of `trace`: how often voxels were stored, 2 if an edit needed others |
| `frameSeconds`, `framesPerSecond`, `raysPerSecond` | of `trace --turn`: of its views |
| `frameSeconds` | of `render --frames`: of every picture, writing left out |
| `sumsHashes` | of `render --sums`: XXH3-64 of the sums of every picture, row by row, channels fastest |
| `rows` | of `speedup`, one entry per number of ranks, partition and block edge: `ranks`, `partition`, `block`, `blocks`; `balance` (mean over largest splats of a rank, mean over views), `worstBalance` (of the worst view), `balancePieces`, `worstBalancePieces` (of pieces of rays; with `--count` of pixels that blocks cover); seconds of a view: `oneSeconds` (one rank), `slowestSeconds` (the slowest of several), `compositeSeconds`; `sentBytes` (most by a rank); `speedup`, `efficiency`, `speedupWithComposite`, `efficiencyWithComposite` |
| `real`, `views`, `clock`, `replicatedSeconds`, `compositeRates` | of `speedup`: whether ranks were processes; views; what clock; attenuation and light, which every rank works out alike before it draws, of a view; what the composite of virtual ranks is reckoned with |
| `partition`, `balance`, `balancePieces` | of several ranks: how blocks were dealt; mean over largest splats, and pieces of rays, of a rank |
| `ranks` | of `trace`: per rank `rank`, `host`, `seconds` (`build`, `trace`), `firstRow`, `rows` of the image, `rays`; of `render`, of several ranks, one entry each: `rank`, `host`, `seconds` (`attenuation`, `light`, `setup`, `draw`, `composite`), `blocks`, `splats`, `fragments`, `pieces`, `sentBytes` (by the composite), `volumeBytes`, `peakMemoryBytes`, all frames together; what stands outside of it are sums (`blocks`, `splats`, `fragments`) or rank 0's |
| `identical`, `psnr`, `ssim`, `rms`, `maxError`, `differingBytes`, `coveredPixels` | of `compare` |
| `pictures` | of `--progressive`, the last included |
| `volumeBytes` | most that values, attenuation and light of the volume took at once: of all of it, or of the bricks in memory, those kept from earlier frames included |
| `peakMemoryBytes` | largest resident memory of the process |
| `warnings` | what the user was warned of |
TEXT
