#extension GL_ARB_gpu_shader_int64 : require
// The voxels of one column that hold a part of a sphere's surface.
#include "shaders/voxlink/sphere_range.glsl"
#include "shaders/voxlink/voxelise.glsl"

flat in uint number;

void main() {
  ivec3 centre;
  int radius;
  snapSphere(number, centre, radius);
  int64_t outer = int64_t(radius + 2), inner = int64_t(max(0, radius - 2));
  ivec3 voxel = ivec3(ivec2(gl_FragCoord.xy), firstOf(centre, radius).z);
  int last = lastOf(centre, radius, dims).z;
  for (; voxel.z <= last; ++voxel.z) {
    int64_t nearest = int64_t(0), farthest = int64_t(0);
    for (int axis = 0; axis < 3; ++axis) {
      int low = voxel[axis] * kSubvoxels - centre[axis], high = low + kSubvoxels;
      int64_t near = int64_t(low > 0 ? low : high < 0 ? high : 0);
      int64_t far = int64_t(max(abs(low), abs(high)));
      nearest += near * near;
      farthest += far * far;
    }
    if (nearest <= outer * outer && farthest >= inner * inner) emit(voxel, kSphere | number, 0u);
  }
}
