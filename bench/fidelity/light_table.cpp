#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>

#include "base/progress.h"
#include "bench/fidelity/tables.h"
#include "splat/pinned_attenuation.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

constexpr int kRepeats = 7;

double frameSeconds(Splatter& splatter, const Camera& view, const SplatOptions& splats) {
  const auto start = std::chrono::steady_clock::now();
  resolve(splatter.render(view, splats, silentProgress()).sums, splats.formula);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Every other one near, so that no direction is shared.
std::vector<Light> lampsRound(const Box& box, size_t count) {
  std::vector<Light> lamps;
  for (size_t lamp = 0; lamp < count; ++lamp) {
    const double angle = 0.7 * double(lamp);
    const glm::dvec3 direction(std::cos(angle), 0.6 - 0.15 * double(lamp), std::sin(angle));
    const bool far = lamp % 2 == 0;
    lamps.push_back({far, far ? direction : box.centre() + glm::length(box.extent()) * direction, glm::vec3(1.0f)});
  }
  return lamps;
}

/// The scene's attenuation file with a pin for every lamp; made once.
AttenuationFile pinnedFile(const Scene& scene, const std::vector<Light>& lamps, const Folders& folders) {
  const std::string path =
      fmt::format("{}/{}-pinned-{}-{:016x}.fvx", folders.cache, scene.source.name, lamps.size(), scene.hash);
  if (!std::filesystem::exists(path)) {
    std::vector<Pin> pins;
    for (const Light& lamp : lamps)
      pins.push_back({lamp.directional, lamp.world});
    pinAttenuation(attenuationFile(scene, Classification::preintegrated, folders).path(), pins, path, silentProgress());
  }
  return AttenuationFile(path);
}

}  // namespace

void addLights(Table& table, const Scene& scene, const TableOptions& options) {
  constexpr size_t kCounts[] = {1, 2, 4, 8};
  if (table.head.empty()) {
    table.head = {"volume", "lamps", "shading", "1 lamp", "2", "4", "8", "allowed: 2", "4", "8"};
  }
  const std::vector<Light> lamps = lampsRound(scene.bounds(), kCounts[std::size(kCounts) - 1]);
  const AttenuationFile file = pinnedFile(scene, lamps, options.folders);
  Splatter splatter(scene.grid, &file, scene.transfer, Backend::cpu);
  const Camera view = randomViews(scene.bounds(), 1, options.imageSize).front();
  for (const AttenuationSource source :
       {AttenuationSource::interpolated, AttenuationSource::stored, AttenuationSource::pinned}) {
    for (const auto& [name, shading] : {std::pair("none", Shading::none), std::pair("phong", Shading::phong)}) {
      SplatOptions splats[std::size(kCounts)];
      std::vector<double> seconds[std::size(kCounts)];
      for (size_t n = 0; n < std::size(kCounts); ++n) {
        splats[n].lightAttenuation = source;
        splats[n].lighting.ambient = 0.2f;
        splats[n].lighting.shading = shading;
        splats[n].lighting.lights.assign(lamps.begin(), lamps.begin() + ptrdiff_t(kCounts[n]));
        for (Light& lamp : splats[n].lighting.lights)
          lamp.linear = glm::vec3(1.0f / float(kCounts[n]));
      }
      for (int repeat = 0; repeat < kRepeats; ++repeat) {
        for (size_t n = 0; n < std::size(kCounts); ++n)
          seconds[n].push_back(frameSeconds(splatter, view, splats[n]));
      }
      for (std::vector<double>& times : seconds)
        std::nth_element(times.begin(), times.begin() + kRepeats / 2, times.end());
      const auto median = [&](size_t n) { return seconds[n][kRepeats / 2]; };
      std::vector<std::string> row = {scene.source.title, std::string(attenuationSourceName(source)), name,
                                      fmt::format("{:.3f} s", median(0))};
      for (size_t n = 1; n < std::size(kCounts); ++n)
        row.push_back(fmt::format("x {:.2f}", median(n) / median(0)));
      for (size_t n = 1; n < std::size(kCounts); ++n)
        row.push_back(fmt::format("x {:.2f}", 1.0 + 0.15 * double(kCounts[n] - 1)));
      table.rows.push_back(row);
    }
  }
}

}  // namespace freevoxel::bench
