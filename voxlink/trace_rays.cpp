#include "voxlink/trace_rays.h"

#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "voxlink/traversal.h"

namespace freevoxel {

Image traceRays(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                std::span<const uint32_t> light, const Camera& camera, ImageRows rows, Progress& progress) {
  check(light.empty() || light.size() == buffers.fragments.size(), "every fragment has light");
  const ViewFrame frame = viewFrame(camera);
  const glm::dmat4 indexFromWorld = glm::inverse(buffers.placement.worldFromIndex());
  const double unit = buffers.placement.unitLength();
  Image picture(glm::ivec2(camera.imageSize.x, rows.count), 4);
  progress.begin("tracing", uint64_t(rows.count), "rows");
#pragma omp parallel for schedule(dynamic, 4)
  for (int y = 0; y < rows.count; ++y) {
    for (int x = 0; x < camera.imageSize.x; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, rows.first + y) + 0.5);
      const glm::dvec3 origin = glm::dvec3(indexFromWorld * glm::dvec4(ray.origin, 1.0)) + 0.5;
      const glm::dvec3 direction(indexFromWorld * glm::dvec4(ray.direction * unit, 0.0));
      glm::vec3 gathered(0.0f);
      float through = 1.0f;
      traverse(buffers, origin, direction, 0.0, [&](size_t fragment, glm::ivec3, double from, double to) {
        const VoxelMaterial& material = materials[shared::fragmentCode(buffers.fragments[fragment])];
        const float passed = std::exp(-material.extinction * float(to - from));
        glm::vec3 colour(material.red, material.green, material.blue);
        if (!light.empty()) {
          glm::vec3 arriving;
          shared::unpackLight(light[fragment], arriving.r, arriving.g, arriving.b);
          colour *= arriving;
        }
        gathered += through * (1.0f - passed) * colour;
        through *= passed;
        return through >= shared::kOpaqueEnough;
      });
      float* pixel = picture.at(x, y);
      pixel[0] = gathered.r;
      pixel[1] = gathered.g;
      pixel[2] = gathered.b;
      pixel[3] = 1.0f - through;
    }
#pragma omp critical(freevoxelTraceProgress)
    progress.advance(1);
  }
  progress.end();
  return picture;
}

}  // namespace freevoxel
