// A kernel splat as one point that covers the part of its rectangle inside the image. The centre of that part is always
// on screen, so no driver drops the point.
layout(location = 0) in vec4 rectangle;  // centre and half sizes, pixels
layout(location = 1) in vec4 conicAndDepth;
layout(location = 2) in vec4 emission;

layout(location = 0) uniform vec2 imageSize;

flat out vec2 splatCentre;
flat out vec4 splatConicAndDepth;
flat out vec4 splatEmission;

void main() {
  vec2 lower = max(rectangle.xy - rectangle.zw, vec2(0.0));
  vec2 upper = min(rectangle.xy + rectangle.zw, imageSize);
  vec2 extent = upper - lower;
  // Two pixels more than needed: coverage may be generous, since the weight is 0 outside the splat.
  gl_PointSize = max(extent.x, extent.y) + 2.0;
  gl_Position = vec4((lower + upper) / imageSize - 1.0, 0.0, 1.0);
  splatCentre = rectangle.xy;
  splatConicAndDepth = conicAndDepth;
  splatEmission = emission;
}
