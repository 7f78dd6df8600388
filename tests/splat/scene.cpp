#include "tests/splat/scene.h"

#include <cmath>
#include <numbers>

#include "precompute/precompute.h"
#include "tests/support/test_data.h"

namespace freevoxel::test {

Volume makeVolume(glm::ivec3 dims, glm::dvec3 spacing, const std::function<int(int, int, int)>& value) {
  Volume volume;
  volume.header.dims = dims;
  volume.header.type = ValueType::u8;
  volume.header.placement.spacing = spacing;
  volume.data.resize(volume.header.bytes());
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x)
        volume.data[linearIndex({x, y, z}, dims)] = std::byte(value(x, y, z));
    }
  }
  return volume;
}

TransferFunction whiteRamp(double opacity) {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(1.0), 0.0}, {255.0, glm::dvec3(1.0), opacity}};
  return transfer;
}

TransferFunction uniformOpacity(double opacity, glm::dvec3 srgb) {
  TransferFunction transfer;
  transfer.points = {{0.0, srgb, 0.0}, {0.5, srgb, 0.0}, {1.0, srgb, opacity}, {255.0, srgb, opacity}};
  return transfer;
}

Scene makeScene(Volume volume, TransferFunction transfer, int brickEdge, Classification classification) {
  Scene scene{std::move(volume), std::move(transfer), nullptr};
  const std::string path = temporaryFolder() + "/scene.fvx";
  PrecomputeOptions options;
  options.brickEdge = brickEdge;
  options.classification = classification;
  options.levels = 0;
  precompute(scene.volume, scene.transfer, path, options, silentProgress());
  scene.file = std::make_unique<AttenuationFile>(path);
  return scene;
}

Scene awkwardScene() {
  TransferFunction transfer;
  transfer.points = {{0.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                     {90.0, glm::dvec3(0.2, 0.9, 0.3), 0.15},
                     {255.0, glm::dvec3(1.0, 0.4, 0.1), 0.9}};
  return makeScene(makeVolume({5, 7, 11}, {0.3, 1.1, 2.7},
                              [](int x, int y, int z) { return (x * 37 + y * 101 + z * 59 + x * y * z * 7) % 256; }),
                   transfer, 8);
}

std::vector<Camera> randomViews(const Box& box, int count, glm::ivec2 imageSize) {
  std::vector<Camera> cameras;
  uint32_t state = 12345;
  const auto random = [&state] {
    state = state * 1664525u + 1013904223u;
    return double(state >> 8) / double(1 << 24);
  };
  for (int i = 0; i < count; ++i) {
    Orbit orbit;
    orbit.azimuth = 2.0 * std::numbers::pi * random();
    orbit.elevation = std::asin(2.0 * random() - 1.0);
    cameras.push_back(orbitCamera(box, orbit, imageSize, std::numbers::pi / 6.0, std::nullopt));
  }
  return cameras;
}

Camera axisView(const Box& box, glm::ivec2 imageSize, double height) {
  return orbitCamera(box, Orbit{}, imageSize, std::numbers::pi / 6.0, height);
}

SplatResult splatScene(const Scene& scene, const Camera& camera, const SplatOptions& options, Backend backend) {
  const ValueGrid grid = valueGrid(*scene.file);
  return Splatter(grid, scene.file.get(), scene.transfer, backend).render(camera, options, silentProgress());
}

Image raycastScene(const Scene& scene, const Camera& camera, const RaycastOptions& options) {
  return raycast(scene.grid(), scene.transfer, camera, options, silentProgress());
}

}  // namespace freevoxel::test
