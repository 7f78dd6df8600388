#include "voxlink/light_voxels.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "base/error.h"
#include "voxlink/shade_run.h"

namespace freevoxel {

void lightVoxels(const VoxLinkBuffers& buffers, const Lighting& lighting, const LightShares& shares,
                 const Camera& camera, std::vector<uint32_t>& light) {
  checkLighting(lighting);
  const size_t fragments = buffers.fragments.size();
  checkEqual(shares.size(), fragments * lighting.lights.size(), "shares of light");
  light.resize(fragments);
  const double unit = buffers.placement.unitLength();
  const auto placeOf = [&](glm::dvec3 world) { return glm::vec3((world - buffers.placement.origin) / unit); };
  ShadingFrame frame;
  frame.shading = lighting.shading;
  frame.ambient = lighting.ambient;
  for (int axis = 0; axis < 3; ++axis)
    frame.lengthFromIndex[axis] =
        glm::vec3(buffers.placement.direction[axis] * (buffers.placement.spacing[axis] / unit));
  frame.eye.directional = camera.orthographicHeight.has_value();
  frame.eye.place = frame.eye.directional ? glm::vec3(glm::normalize(camera.eye - camera.target)) : placeOf(camera.eye);
  std::vector<ShadingLamp> lamps;
  for (const Light& lamp : lighting.lights) {
    ShadingLamp& own = lamps.emplace_back();
    own.directional = lamp.directional;
    own.place = lamp.directional ? glm::vec3(glm::normalize(lamp.world)) : placeOf(lamp.world);
    own.linear = lamp.linear;
    own.shares = shares.data() + (lamps.size() - 1) * fragments;
  }
  frame.lamps = lamps;

  const BrickGrid& grid = buffers.grid;
  const int edge = grid.edge;
#pragma omp parallel
  {
    VoxelRun run{};
#pragma omp for schedule(dynamic, 64)
    for (int64_t at = 0; at < int64_t(grid.bricks()); ++at) {
      const glm::ivec3 brick = grid.position(uint64_t(at));
      const uint32_t* header = buffers.header(brick);
      if (header == nullptr) continue;
      size_t first = header[0];
      const auto shade = [&] {
        std::copy_n(buffers.fragments.data() + first, run.count, run.fragments);
        shadeRun(frame, first, run);
        std::copy_n(run.light, run.count, light.data() + first);
        first += run.count;
        run.count = 0;
      };
      for (int column = 0; column < edge * edge; ++column) {
        const float x = float(brick.x * edge + column % edge), y = float(brick.y * edge + column / edge);
        if (run.count + size_t(edge) > VoxelRun::kMost) shade();
        for (uint32_t mask = listMask(header, edge, column); mask != 0; mask &= mask - 1) {
          run.x[run.count] = x;
          run.y[run.count] = y;
          run.z[run.count++] = float(brick.z * edge + std::countr_zero(mask));
        }
      }
      shade();
    }
  }
}

}  // namespace freevoxel
