#include "bench/fidelity/figures.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <glm/glm.hpp>
#include <numbers>

#include "base/error.h"
#include "base/progress.h"
#include "precompute/precompute.h"
#include "shaders/shared/directions.h"
#include "shaders/shared/kernel_splat.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

/// A grey box, every voxel alike: the paper's example.
struct UniformBox {
  glm::ivec3 dims;
  double opacity;
  Volume volume;
  TransferFunction transfer;
  ValueGrid grid;
};

UniformBox uniformBox(glm::ivec3 dims, double opacity) {
  UniformBox box{dims, opacity, {}, {}, {}};
  box.volume.header.dims = dims;
  box.volume.header.type = ValueType::u8;
  box.volume.data.assign(box.volume.header.bytes(), std::byte(128));
  box.transfer.points = {{0.0, glm::dvec3(0.8), opacity}, {255.0, glm::dvec3(0.8), opacity}};
  box.grid = valueGrid(box.volume, box.transfer);
  return box;
}

std::ofstream openText(const std::string& path) {
  std::ofstream file(path);
  if (!file) throw MachineError(fmt::format("{}: cannot be written", path));
  return file;
}

/// Attenuation in the middle slice along four of the 26 directions, side by side (Fig. 2).
void drawAttenuation(const UniformBox& box, const AttenuationFile& file, const std::string& path) {
  constexpr glm::ivec3 kShown[] = {{1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {-1, 1, 1}};
  constexpr int kScale = 4, kGap = 8;
  const glm::ivec2 slice(box.dims.x * kScale, box.dims.y * kScale);
  Image picture({int(std::size(kShown)) * (slice.x + kGap) - kGap, slice.y}, 4);
  for (size_t i = 0; i < std::size(kShown); ++i) {
    const int direction = shared::directionIndex(kShown[i].x, kShown[i].y, kShown[i].z);
    for (int y = 0; y < slice.y; ++y) {
      for (int x = 0; x < slice.x; ++x) {
        const glm::ivec3 voxel(x / kScale, box.dims.y - 1 - y / kScale, box.dims.z / 2);
        const BrickView brick = file.brick(file.findBrick(voxel / file.brickEdge()).value());
        const glm::ivec3 local = voxel - brick.origin;
        const size_t step = brick.steps[size_t((local.z * brick.edge + local.y) * brick.edge + local.x)];
        const float attenuation = float(brick.attenuations[direction][step]) / 255.0f;
        float* pixel = picture.at(int(i) * (slice.x + kGap) + x, y);
        std::fill_n(pixel, 3, linearFromSrgb(attenuation));
        pixel[3] = 1.0f;
      }
    }
  }
  writePng(path, picture, {{"Software", "freevoxel"}});
}

/// Sum over a plane of voxels of the weights of their kernels, along a line (Fig. 4): ours, the Gaussian of peak 1 and
/// a Gaussian of the same width whose area is 1.
void writeWeights(const std::string& path) {
  constexpr float kRadius = shared::kKernelRadius, kConic = 1.0f / (kRadius * kRadius);
  constexpr float kDeviation = 0.416f;  // of our kernel
  std::ofstream file = openText(path);
  file << "# position  one kernel  sum  sum of Gaussians of area 1  sum of Gaussians of peak 1\n";
  for (int i = -200; i <= 200; ++i) {
    const float at = float(i) / 100.0f;
    float sum = 0.0f, area = 0.0f, peak = 0.0f;
    for (int y = -4; y <= 4; ++y) {
      for (int x = -6; x <= 6; ++x) {
        const float dx = at - float(x), dy = 0.25f - float(y), squared = dx * dx + dy * dy;
        sum += shared::kernelWeight(dx, dy, kConic, 0.0f, kConic);
        area += std::exp(-squared / (2.0f * kDeviation * kDeviation)) /
                (2.0f * std::numbers::pi_v<float> * kDeviation * kDeviation);
        peak += std::exp(-squared / (2.0f * kGaussianDeviation * kGaussianDeviation));
      }
    }
    file << fmt::format("{} {} {} {} {}\n", at, shared::kernelWeight(at, 0.25f, kConic, 0.0f, kConic), sum, area, peak);
  }
}

/// The ray's way through the box, in shortest voxel edges (which are 1 here, as are world lengths).
double wayThrough(const UniformBox& box, const Ray& ray) {
  double enter = 0.0, leave = INFINITY;
  for (int axis = 0; axis < 3; ++axis) {
    const double t0 = (-0.5 - ray.origin[axis]) / ray.direction[axis];
    const double t1 = (double(box.dims[axis]) - 0.5 - ray.origin[axis]) / ray.direction[axis];
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return std::max(0.0, leave - enter);
}

/// The box by every method, and the alpha of the middle row beside its closed form (Fig. 6): NAME-*.png and NAME.dat.
void drawLeak(const UniformBox& box, const AttenuationFile& file, const std::string& name) {
  Splatter splatter(box.grid, &file, box.transfer, Backend::cpu);
  const Camera camera =
      orbitCamera(worldBounds(box.grid.placement, box.dims), {0.6, 0.35, std::nullopt}, {360, 300}, 0.5, std::nullopt);
  SplatOptions kernels, cells;
  kernels.footprint = Footprint::kernel;
  kernels.attenuation = cells.attenuation = AttenuationSource::interpolated;
  const Image pictures[] = {splatter.renderBlended(camera, BlendKernel::gaussian, {}, silentProgress()).image,
                            splatter.renderBlended(camera, BlendKernel::normalised, {}, silentProgress()).image,
                            resolve(splatter.render(camera, kernels, silentProgress()).sums, Formula::normalised),
                            resolve(splatter.render(camera, cells, silentProgress()).sums, Formula::normalised)};
  const char* const names[] = {"blended-gaussian", "blended-normalised", "kernels", "cells"};
  for (size_t i = 0; i < std::size(pictures); ++i)
    writePng(fmt::format("{}-{}.png", name, names[i]), pictures[i], {{"Software", "freevoxel"}});
  std::ofstream rows = openText(name + ".dat");
  rows << "# pixel  closed form  blended, Gaussian of peak 1  blended, normalised kernel  kernels  cells\n";
  const ViewFrame frame = viewFrame(camera);
  const double extinction = -std::log1p(-box.opacity);
  const int y = camera.imageSize.y / 2;
  for (int x = 0; x < camera.imageSize.x; ++x) {
    rows << x << ' ' << -std::expm1(-extinction * wayThrough(box, pixelRay(frame, {x + 0.5, y + 0.5})));
    for (const Image& picture : pictures)
      rows << ' ' << picture.at(x, y)[3];
    rows << '\n';
  }
}

}  // namespace

void drawFigures(const std::string& folder, const Folders& folders) {
  std::filesystem::create_directories(folder);
  writeWeights(folder + "/figure4.dat");
  const auto fileOf = [&](const UniformBox& box, const std::string& name) {
    const std::string path = folders.cache + "/" + name + ".fvx";
    precompute(box.volume, box.transfer, path, {}, silentProgress());
    return AttenuationFile(path);
  };
  const UniformBox box = uniformBox({44, 40, 36}, 0.04);
  const AttenuationFile file = fileOf(box, "uniform-box");
  drawAttenuation(box, file, folder + "/figure2.png");
  drawLeak(box, file, folder + "/figure6");
  // Of the same opacity as a whole: where a voxel takes much, in-order blending of overlapping kernels leaks, too.
  const UniformBox slab = uniformBox({44, 40, 4}, 0.4);
  drawLeak(slab, fileOf(slab, "uniform-slab"), folder + "/figure6-slab");
}

}  // namespace freevoxel::bench
