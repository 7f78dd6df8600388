// A block as the rectangle of pixels that its rays may pass. One instance per block.
layout(location = 0) in ivec4 bounds;  // low x, low y, high x, high y; high exclusive

layout(location = 0) uniform vec2 imageSize;

flat out int block;

void main() {
  vec2 corner = vec2((gl_VertexID & 1) != 0 ? bounds.z : bounds.x, (gl_VertexID & 2) != 0 ? bounds.w : bounds.y);
  gl_Position = vec4(corner / imageSize * 2.0 - 1.0, 0.0, 1.0);
  block = gl_InstanceID;
}
