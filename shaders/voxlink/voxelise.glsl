// Where what fills voxels goes, in three stages: counts per brick, counts per voxel of occupied bricks, entries.
layout(std430, binding = 0) buffer Bricks { uvec2 bricks[]; };  // occupied, entries; later those before
layout(std430, binding = 1) buffer Table { uvec2 table[]; };    // per voxel of occupied bricks: filled, entries; or before
// voxel's place in the table, key (voxlink/scene_buffers.cpp), number of the triangle or sample
layout(std430, binding = 2) writeonly buffer Entries { uvec4 entries[]; };

layout(location = 0) uniform ivec3 dims;
layout(location = 1) uniform int edge;
layout(location = 2) uniform int stage;

uint brickOf(ivec3 voxel) {
  ivec3 size = (dims + edge - 1) / edge;
  ivec3 brick = voxel / edge;
  return (uint(brick.z) * uint(size.y) + uint(brick.y)) * uint(size.x) + uint(brick.x);
}

void emit(ivec3 voxel, uint key, uint reference) {
  uint brick = brickOf(voxel);
  if (stage == 0) {
    if (atomicAdd(bricks[brick].y, 1u) == 0u) bricks[brick].x = 1u;
    return;
  }
  ivec3 local = voxel % edge;
  uint place = bricks[brick].x * uint(edge * edge * edge) + uint((local.y * edge + local.x) * edge + local.z);
  uint before = atomicAdd(table[place].y, 1u);
  if (stage == 1) {
    if (before == 0u) table[place].x = 1u;
  } else {
    entries[before] = uvec4(place, key, reference, 0u);
  }
}
