#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/glm.hpp>

#include "base/compare.h"
#include "base/error.h"
#include "base/grid.h"
#include "bench/fidelity/measured.h"
#include "bench/hierarchy/tables.h"
#include "hierarchy/value_grid.h"
#include "precompute/precompute.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

constexpr int kLevels = 3;

/// The mean of every square of n x n pixels.
Image lowPassed(const Image& fine, int n) {
  Image result(fine.size / n, fine.channels);
  for (int y = 0; y < result.size.y; ++y) {
    for (int x = 0; x < result.size.x; ++x) {
      for (int channel = 0; channel < fine.channels; ++channel) {
        double sum = 0.0;
        for (int i = 0; i < n * n; ++i)
          sum += double(fine.at(x * n + i % n, y * n + i / n)[channel]);
        result.at(x, y)[channel] = float(sum / (n * n));
      }
    }
  }
  return result;
}

/// Orthographic, and a pixel as large as the longest edge of a voxel of the level.
Camera levelCamera(const Camera& from, const Placement& placement, const Box& bounds, int level) {
  const glm::dvec3 spacing = placement.spacing;
  const double pixel = std::max({spacing.x, spacing.y, spacing.z}) * double(1 << level);
  Camera camera = from;
  const int size = int(std::ceil(glm::length(bounds.extent()) / pixel));
  camera.imageSize = glm::ivec2(size);
  camera.orthographicHeight = size * pixel;
  return camera;
}

/// Every voxel the mean of the values of up to eight of `fine`: levels of detail without a hierarchy of what is seen.
ValueGrid meanValues(const ValueGrid& fine) {
  ValueGrid coarse;
  coarse.dims = (fine.dims + 1) / 2;
  coarse.placement = fine.placement;
  coarse.placement.spacing *= 2.0;
  coarse.placement.origin += fine.placement.direction * (0.5 * fine.placement.spacing);
  coarse.coding = fine.coding;
  coarse.codes.resize(voxelCount(coarse.dims));
  for (int z = 0; z < coarse.dims.z; ++z) {
    for (int y = 0; y < coarse.dims.y; ++y) {
      for (int x = 0; x < coarse.dims.x; ++x) {
        uint32_t sum = 0, count = 0;
        for (int child = 0; child < 8; ++child) {
          const glm::ivec3 p = 2 * glm::ivec3(x, y, z) + glm::ivec3(child & 1, child >> 1 & 1, child >> 2);
          if (glm::any(glm::greaterThanEqual(p, fine.dims))) continue;
          sum += fine.codes[linearIndex(p, fine.dims)];
          ++count;
        }
        coarse.codes[linearIndex({x, y, z}, coarse.dims)] = uint16_t((sum + count / 2) / count);
      }
    }
  }
  return coarse;
}

/// Alpha alone, as a picture.
Image alphaOf(Image image) {
  for (size_t i = 0; i < image.pixels.size(); i += 4)
    std::fill_n(image.pixels.begin() + ptrdiff_t(i), 3, image.pixels[i + 3]);
  return image;
}

/// One row.
struct Row {
  std::vector<Measured> ofLevel = std::vector<Measured>(kLevels), alphaOfLevel = std::vector<Measured>(kLevels);

  void add(int level, const Image& picture, const Image& reference) {
    ofLevel[size_t(level) - 1].add(compareImages(picture, reference));
    alphaOfLevel[size_t(level) - 1].add(compareImages(alphaOf(picture), alphaOf(reference)));
  }
  void addTo(Table& table, const std::string& volume, const std::string& name, const std::string& bytes) const {
    std::vector<std::string> row = {volume, name};
    for (const Measured& measured : ofLevel)
      row.push_back(measured.text());
    for (const Measured& measured : alphaOfLevel)
      row.push_back(fmt::format("{:.1f}", measured.pooled()));
    row.push_back(bytes);
    fmt::print(stderr, "{} {}: {} {} {}\n", row[0], row[1], row[2], row[3], row[4]);
    table.rows.push_back(row);
  }
};

}  // namespace

AttenuationFile levelFile(const Scene& scene, Hierarchy hierarchy, int levels, const Folders& folders) {
  const std::string path = fmt::format("{}/{}-levels-{}-{:016x}.fvx", folders.cache, scene.source.name,
                                       hierarchyName(hierarchy), scene.hash);
  PrecomputeOptions options;
  options.layout = Layout::compact;
  options.levels = levels;
  options.hierarchy = hierarchy;
  precompute(scene.volume, scene.transfer, path, options, silentProgress());
  return AttenuationFile(path);
}

void addLevels(Table& table, const Scene& scene, const TableOptions& options) {
  if (table.head.empty()) {
    table.head = {"volume",  "hierarchy", "level 1",
                  "level 2", "level 3",   "alpha, level 1",
                  "2",       "3",         "bytes of levels per voxel"};
  }
  Row finest, values;
  // Extinction is per shortest edge, and stays what it is per length.
  TransferFunction transfer = scene.transfer;
  std::vector<ValueGrid> grids = {meanValues(scene.grid)};
  while (grids.size() < kLevels)
    grids.push_back(meanValues(grids.back()));
  std::vector<Splatter> ofValues;
  for (const ValueGrid& grid : grids) {
    transfer.referenceLength *= 0.5;
    ofValues.emplace_back(grid, nullptr, transfer, Backend::cpu);
  }
  for (const Hierarchy hierarchy : {Hierarchy::geometric, Hierarchy::weighted}) {
    const AttenuationFile file = levelFile(scene, hierarchy, kLevels + 1, options.folders);
    Splatter splatter(file, scene.transfer, Backend::cpu);
    const auto draw = [&](const Camera& camera, double lod) {
      SplatOptions splat;
      splat.lodPixels = lod;
      return splatter.render(camera, splat, silentProgress());
    };
    Row row;
    for (int level = 1; level <= kLevels; ++level) {
      for (const Camera& view : randomViews(scene.bounds(), options.views, {16, 16})) {
        const Camera coarse = levelCamera(view, scene.grid.placement, scene.bounds(), level);
        Camera fine = coarse;
        fine.imageSize *= 1 << level;
        const Image reference = lowPassed(resolve(draw(fine, 0.0).sums, Formula::normalised), 1 << level);
        const SplatResult result = draw(coarse, 1.001);  // every block's voxels are one pixel
        if (result.statistics.blocksOfLevel.size() != size_t(level) + 1)
          throw InternalError("internal error: another level was drawn");
        row.add(level, resolve(result.sums, Formula::normalised), reference);
        if (hierarchy != Hierarchy::geometric) continue;
        finest.add(level, resolve(draw(coarse, 0.0).sums, Formula::normalised), reference);
        const SplatResult means = ofValues[size_t(level) - 1].render(coarse, {}, silentProgress());
        values.add(level, resolve(means.sums, Formula::normalised), reference);
      }
    }
    row.addTo(table, scene.source.title, std::string(hierarchyName(hierarchy)),
              fmt::format("{:.3f}", double(file.levelBytes()) / double(voxelCount(file.dims()))));
    std::filesystem::remove(file.path());
  }
  values.addTo(table, scene.source.title, "mean values, swept", "");
  finest.addTo(table, scene.source.title, "the finest, one ray per pixel", "");
}

}  // namespace freevoxel::bench
