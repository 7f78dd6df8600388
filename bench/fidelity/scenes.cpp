#include "bench/fidelity/scenes.h"

#include <fmt/core.h>
#include <xxhash.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>
#include <numbers>

#include "precompute/precompute.h"
#include "volume/procedural.h"
#include "volume/read_volume.h"
#include "volume/transfer_presets.h"

namespace freevoxel::bench {

namespace {

/// Of procedural volumes. Nearly a cube, so that pictures are comparable, but not one.
constexpr glm::ivec3 kDims{132, 128, 124};

/// A generator of our own, so that views are the same everywhere.
class Random {
 public:
  double next() {
    state_ = state_ * 1664525u + 1013904223u;
    return double(state_ >> 8) / double(1 << 24);
  }

 private:
  uint32_t state_ = 12345;
};

std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

VolumeOptions optionsOf(const SceneSource& source) {
  VolumeOptions options;
  const auto raw = [&](glm::ivec3 dims, ValueType type) {
    options.dims = dims;
    options.type = type;
  };
  if (source.file.find("cthead_") != std::string::npos) {
    raw({256, 256, 113}, ValueType::u16);
    options.byteOrder = ByteOrder::big;
    options.spacing = glm::dvec3(1.0, 1.0, 2.0);
  } else if (source.file.ends_with(".raw.gz")) {
    raw({256, 256, 256}, ValueType::u8);
  }
  return options;
}

}  // namespace

const std::vector<SceneSource>& sceneSources() {
  const std::string ctHead = "volumes/cthead_256x256x113_uint16_be.raw.gz";
  static const std::vector<SceneSource> sources = {
      {"cube", "cube", "cube", "", "cube.json"},
      {"dense-cube", "dense cube", "cube", "", "dense-cube.json"},
      {"sphere", "sphere", "sphere", "", "sphere.json"},
      {"cloud", "cloud", "cloud", "", "cloud.json"},
      {"checkered-cloud", "checkered cloud", "checkered-cloud", "", "checkered-cloud.json"},
      {"shells", "shells", "shells", "", "shells.json"},
      {"carp", "carp", "", "volumes/carp.nii.gz", "carp.json"},
      {"cthead", "CThead", "", ctHead, "cthead.json"},
      {"cthead-coloured", "CThead, coloured", "", ctHead, "cthead_coloured.json"},
      {"cthead-opaque", "CThead, opaque", "", ctHead, "cthead_opaque.json"},
      {"embryo", "embryo", "", "volumes/embryo_256x256x256_uint8.raw.gz", "embryo.json"},
      {"aneurism", "aneurism", "", "volumes/aneurism_256x256x256_uint8.raw.gz", "aneurism.json"},
      {"stent", "stent", "", "volumes/stent.nrrd", "stent.json"},
  };
  return sources;
}

std::unique_ptr<Scene> loadScene(const SceneSource& source, const Folders& folders) {
  const std::string path = folders.data + "/" + source.file;
  if (source.real() && !std::filesystem::exists(path)) return nullptr;
  auto scene = std::make_unique<Scene>();
  scene->source = source;
  const std::string transferPath = folders.transfers + "/" + source.transfer;
  scene->transfer = readTransferFunction(transferPath);
  scene->volume = source.real() ? readVolume(path, optionsOf(source)) : generateVolume(source.kind, kDims);
  scene->grid = valueGrid(scene->volume, scene->transfer);
  const std::string text = readText(transferPath);
  const std::vector<uint16_t>& codes = scene->grid.codes;
  scene->hash = XXH3_64bits_withSeed(codes.data(), codes.size() * sizeof(codes[0]),
                                     XXH3_64bits_withSeed(text.data(), text.size(), uint64_t(scene->grid.dims.x)));
  return scene;
}

AttenuationFile attenuationFile(const Scene& scene, Classification classification, const Folders& folders) {
  const std::string path = fmt::format("{}/{}-{}-{:016x}.fvx", folders.cache, scene.source.name,
                                       classificationName(classification), scene.hash);
  if (!std::filesystem::exists(path)) {
    PrecomputeOptions options;
    options.classification = classification;
    precompute(scene.volume, scene.transfer, path, options, silentProgress());
  }
  return AttenuationFile(path);
}

std::vector<Camera> randomViews(const Box& box, int count, glm::ivec2 imageSize) {
  Random random;
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    Orbit orbit;
    orbit.azimuth = 2.0 * std::numbers::pi * random.next();
    orbit.elevation = std::asin(2.0 * random.next() - 1.0);
    cameras.push_back(orbitCamera(box, orbit, imageSize, std::numbers::pi / 6.0, std::nullopt));
  }
  return cameras;
}

std::vector<Camera> insideViews(const Box& box, int count, glm::ivec2 imageSize) {
  Random random;
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    Camera camera;
    const glm::dvec3 size = box.extent();
    for (int axis = 0; axis < 3; ++axis)
      camera.eye[axis] = box.lower[axis] + size[axis] * (0.1 + 0.8 * random.next());
    const double azimuth = 2.0 * std::numbers::pi * random.next(), height = 1.9 * random.next() - 0.95;
    const double flat = std::sqrt(1.0 - height * height);
    camera.target =
        camera.eye + glm::length(size) * glm::dvec3(flat * std::cos(azimuth), height, flat * std::sin(azimuth));
    camera.verticalFov = std::numbers::pi / 3.0;
    camera.imageSize = imageSize;
    cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace freevoxel::bench
