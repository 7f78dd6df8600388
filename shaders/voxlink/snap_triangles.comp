#extension GL_ARB_gpu_shader_int64 : require
// Puts triangles on the grid of subvoxels.
layout(local_size_x = 64) in;

#include "shaders/voxlink/triangle.glsl"

layout(std430, binding = 0) readonly buffer Positions { float positions[]; };
layout(std430, binding = 1) readonly buffer Corners { uint corners[]; };
layout(std430, binding = 2) readonly buffer MaterialOfTriangle { uint materialOfTriangle[]; };
layout(std430, binding = 3) writeonly buffer Triangles { SnappedTriangle triangles[]; };
layout(std430, binding = 4) buffer Degenerate { uint degenerate; };

layout(location = 0) uniform uint count;
layout(location = 1) uniform vec3 origin;
layout(location = 2) uniform float scale;

void main() {
  uint i = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex;
  if (i >= count) return;
  SnappedTriangle t;
  for (int corner = 0; corner < 3; ++corner) {
    uint vertex = corners[3u * i + uint(corner)];
    for (int axis = 0; axis < 3; ++axis)
      t.place[3 * corner + axis] = snapped(positions[3u * vertex + uint(axis)], origin[axis], scale);
  }
  WideVector normal = normalOf(t);
  int64_t longest = normal.x;
  t.axis = 0u;
  for (int axis = 1; axis < 3; ++axis) {
    int64_t other = along(normal, axis);
    if (magnitude(other) > magnitude(longest)) {
      longest = other;
      t.axis = uint(axis);
    }
  }
  t.key = kTriangles | materialOfTriangle[i] << 3 | (t.axis + (longest < 0 ? 3u : 0u));
  t.unused = 0u;
  if (longest == 0) {
    t.axis = 3u;
    atomicAdd(degenerate, 1u);
  }
  triangles[i] = t;
}
