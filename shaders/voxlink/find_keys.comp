// Which entries are the first of their key in their voxel, and how many keys each voxel has: they become its fragments.
layout(local_size_x = 64) in;

#include "shaders/voxlink/entries.glsl"

layout(std430, binding = 3) buffer Most { uint mostEntries, mostKeys; };  // of a voxel

void main() {
  uint i = entryNumber();
  if (i >= count) return;
  uvec4 entry = entries[i];
  uint first = firstEntry(entry.x);
  atomicMax(mostEntries, i - first + 1u);
  if (i - first > 60000u) return;  // the build is given up
  bool known = false;
  for (uint j = first; j < i && !known; ++j)
    known = entries[j].y == entry.y;
  if (known) return;
  entries[i].w = 1u;
  atomicMax(mostKeys, atomicAdd(starts[table[entry.x].x].y, 1u) + 1u);
}
