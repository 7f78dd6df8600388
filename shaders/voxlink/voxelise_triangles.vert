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
  ivec3 first = turned(firstVoxel(lowOf(t)), axis), last = turned(lastVoxel(highOf(t), dims), axis);
  // A quarter of a pixel beyond the first's and the last's centres, clear of all others.
  bool right = corner == 1 || corner == 2 || corner == 4;
  bool top = corner == 2 || corner == 4 || corner == 5;
  vec2 pixel = vec2(right ? float(last.x) + 0.75 : float(first.x) + 0.25,
                    top ? float(last.y) + 0.75 : float(first.y) + 0.25);
  gl_Position = vec4(2.0 * pixel / vec2(turned(dims, axis).xy) - 1.0, 0.0, 1.0);
}
