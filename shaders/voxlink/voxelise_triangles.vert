#extension GL_ARB_gpu_shader_int64 : require
// The rectangle of columns that a triangle may touch, looking along an axis: triangles that face along another one have
// none (papers/voxlink section 3.1.1; conservative, so nothing depends on the rasteriser's rule).
#include "shaders/voxlink/triangle.glsl"

layout(std430, binding = 3) readonly buffer Triangles { SnappedTriangle triangles[]; };

layout(location = 0) uniform ivec3 dims;
layout(location = 3) uniform int axis;

flat out uint number;

void main() {
  number = uint(gl_VertexID) / 6u;
  int corner = gl_VertexID % 6;
  SnappedTriangle t = triangles[number];
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // outside
  if (t.axis != uint(axis)) return;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  ivec3 first = firstVoxel(lowOf(t)), last = lastVoxel(highOf(t), dims);
  // A quarter of a pixel beyond the first's and the last's centres, clear of all others.
  bool right = corner == 1 || corner == 2 || corner == 4;
  bool top = corner == 2 || corner == 4 || corner == 5;
  vec2 pixel = vec2(right ? float(last[u]) + 0.75 : float(first[u]) + 0.25,
                    top ? float(last[v]) + 0.75 : float(first[v]) + 0.25);
  gl_Position = vec4(2.0 * pixel / vec2(dims[u], dims[v]) - 1.0, 0.0, 1.0);
}
