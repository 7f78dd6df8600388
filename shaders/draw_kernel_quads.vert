// A kernel splat as a rectangle of two triangles, for splats beyond the driver's point size. One instance per splat.
layout(location = 0) in vec4 rectangle;  // centre and half sizes, pixels
layout(location = 1) in vec4 conicAndDepth;
layout(location = 2) in vec4 emission;

layout(location = 0) uniform vec2 imageSize;

flat out vec2 splatCentre;
flat out vec4 splatConicAndDepth;
flat out vec4 splatEmission;

void main() {
  vec2 lower = max(rectangle.xy - rectangle.zw - 1.0, vec2(-1.0));
  vec2 upper = min(rectangle.xy + rectangle.zw + 1.0, imageSize + 1.0);
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = vec4(mix(lower, upper, corner) / imageSize * 2.0 - 1.0, 0.0, 1.0);
  splatCentre = rectangle.xy;
  splatConicAndDepth = conicAndDepth;
  splatEmission = emission;
}
