// The rectangle of columns along z that a sphere may touch.
#include "shaders/voxlink/sphere_range.glsl"

layout(location = 0) uniform ivec3 dims;

flat out uint number;

void main() {
  number = uint(gl_VertexID) / 6u;
  int corner = gl_VertexID % 6;
  ivec3 centre;
  int radius;
  snapSphere(number, centre, radius);
  ivec3 first = firstOf(centre, radius), last = lastOf(centre, radius, dims);
  bool right = corner == 1 || corner == 2 || corner == 4;
  bool top = corner == 2 || corner == 4 || corner == 5;
  vec2 pixel = vec2(right ? float(last.x) + 0.75 : float(first.x) + 0.25,
                    top ? float(last.y) + 0.75 : float(first.y) + 0.25);
  gl_Position = vec4(2.0 * pixel / vec2(dims.xy) - 1.0, 0.0, 1.0);
}
