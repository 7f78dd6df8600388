#include "tests/voxlink/voxlink_scenes.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include "base/compare.h"
#include "voxlink/buffers.h"

namespace freevoxel::test {

namespace {

Volume byteVolume(glm::ivec3 dims, glm::dvec3 spacing, int (*value)(int, int, int)) {
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

}  // namespace

VoxLinkScene scatteredScene() {
  VoxLinkScene scene;
  scene.volume = byteVolume({13, 29, 7}, {0.3, 1.1, 0.7}, [](int x, int y, int z) {
    uint32_t state = uint32_t(x * 73856093 ^ y * 19349663 ^ z * 83492791);
    state = (state ^ state >> 13) * 0x5bd1e995u;
    return int(state >> 16 & 255u);
  });
  scene.volume.header.placement.origin = {3.0, -2.0, 0.5};
  scene.transfer.points = {{0.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                           {170.0, glm::dvec3(0.2, 0.9, 0.3), 0.0},
                           {255.0, glm::dvec3(1.0, 0.4, 0.1), 0.9}};
  return scene;
}

VoxLinkScene floatScene() {
  VoxLinkScene scene;
  Volume& volume = scene.volume;
  volume.header.dims = {21, 10, 34};
  volume.header.type = ValueType::f32;
  volume.header.placement.spacing = {1.0, 2.0, 0.5};
  std::vector<float> values(volume.header.voxels());
  for (int z = 0; z < 34; ++z) {
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 21; ++x) {
        values[linearIndex({x, y, z}, volume.header.dims)] =
            std::sin(0.4f * float(x)) + std::cos(0.5f * float(y)) * std::sin(0.2f * float(z));
      }
    }
  }
  values[500] = std::numeric_limits<float>::quiet_NaN();
  values[501] = std::numeric_limits<float>::infinity();
  volume.data.resize(volume.header.bytes());
  std::memcpy(volume.data.data(), values.data(), volume.data.size());
  scene.transfer.low = -2.0;
  scene.transfer.high = 2.0;
  scene.transfer.points = {{-2.0, glm::dvec3(0.1, 0.2, 1.0), 0.0},
                           {0.0, glm::dvec3(0.9, 0.2, 0.3), 0.0},
                           {2.0, glm::dvec3(1.0, 0.9, 0.1), 0.4}};
  return scene;
}

VoxLinkScene ballAboveAFloor() {
  VoxLinkScene scene;
  scene.volume = byteVolume({40, 30, 36}, glm::dvec3(1.0), [](int x, int y, int z) {
    const bool ball = std::hypot(x - 20.0, y - 15.0, z - 18.0) < 5.0;
    return ball || y < 3 ? 255 : 0;
  });
  scene.transfer.points = {{0.0, glm::dvec3(1.0), 0.0},
                           {0.5, glm::dvec3(1.0), 0.0},
                           {1.0, glm::dvec3(1.0), 0.9},
                           {255.0, glm::dvec3(1.0), 0.9}};
  return scene;
}

std::vector<Camera> viewsOf(const Box& box, int count, glm::ivec2 imageSize) {
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
    const std::optional<double> height = i % 3 == 2 ? std::optional<double>(0.0) : std::nullopt;
    cameras.push_back(orbitCamera(box, orbit, imageSize, std::numbers::pi / 6.0, height));
  }
  return cameras;
}

std::vector<std::array<int, 4>> plainLoop(const ValueGrid& grid, const TransferFunction& transfer, double threshold) {
  std::vector<std::array<int, 4>> voxels;
  for (int z = 0; z < grid.dims.z; ++z) {
    for (int y = 0; y < grid.dims.y; ++y) {
      for (int x = 0; x < grid.dims.x; ++x) {
        const int code = grid.codes[linearIndex({x, y, z}, grid.dims)];
        if (transfer.opacityAt(grid.coding.decode(code)) > threshold) voxels.push_back({x, y, z, code});
      }
    }
  }
  return voxels;
}

std::vector<std::array<int, 4>> voxelsIn(const VoxLinkBuffers& buffers) {
  std::vector<std::array<int, 4>> voxels(buffers.fragments.size());
  forEachStoredVoxel(buffers, [&](size_t fragment, glm::ivec3 voxel) {
    voxels.at(fragment) = {voxel.x, voxel.y, voxel.z, int(shared::fragmentCode(buffers.fragments[fragment]))};
  });
  std::sort(voxels.begin(), voxels.end(), [](const auto& a, const auto& b) {
    return std::array{a[2], a[1], a[0]} < std::array{b[2], b[1], b[0]};
  });
  return voxels;
}

ValueGrid onlyStored(ValueGrid grid, const std::vector<uint8_t>& stored) {
  for (uint16_t& code : grid.codes) {
    if (stored[code] == 0) code = 0;
  }
  return grid;
}

TracerDifference compareTracers(const Image& a, const Image& b, float rounding) {
  TracerDifference result;
  double sum = 0.0;
  for (size_t i = 0; i < a.pixels.size(); i += 4) {
    if (a.pixels[i + 3] == 0.0f && b.pixels[i + 3] == 0.0f) continue;
    ++result.covered;
    double most = 0.0, signedSum = 0.0;
    for (size_t c = 0; c < 4; ++c) {
      const double difference = double(a.pixels[i + c]) - double(b.pixels[i + c]);
      most = std::max(most, std::abs(difference));
      signedSum += difference;
    }
    if (most > double(rounding)) {
      ++result.flipped;
      sum += signedSum / 4.0;
    } else {
      result.largestUnflipped = std::max(result.largestUnflipped, most);
    }
  }
  result.meanFlip = result.covered > 0 ? sum / double(result.covered) : 0.0;
  result.psnr = compareImages(a, b).psnr;
  return result;
}

}  // namespace freevoxel::test
