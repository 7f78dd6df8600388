#include <fmt/core.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "bench/fidelity/tables.h"
#include "splat/coarse_volume.h"
#include "splat/near_field.h"
#include "splat/raycast.h"
#include "splat/stored_attenuation.h"

namespace freevoxel::bench {

namespace {

constexpr double kMarchStep = 0.125;
constexpr size_t kMostSamples = 20000;

/// Visible voxels evenly out of all, and how opaque each is.
struct Samples {
  std::vector<glm::dvec3> positions;
  std::vector<uint64_t> voxels;
  std::vector<double> opacities;
};

Samples visibleSamples(const Scene& scene, std::span<const Classified> ofCode) {
  const ValueGrid& grid = scene.grid;
  uint64_t visible = 0;
  for (const uint16_t code : grid.codes)
    visible += ofCode[code].extinction > 0.0f ? 1 : 0;
  const uint64_t every = std::max(uint64_t(1), visible / kMostSamples);
  Samples samples;
  uint64_t seen = 0;
  for (uint64_t at = 0; at < grid.codes.size(); ++at) {
    const float extinction = ofCode[grid.codes[at]].extinction;
    if (extinction <= 0.0f || seen++ % every != 0) continue;
    samples.voxels.push_back(at);
    samples.positions.emplace_back(double(at % uint64_t(grid.dims.x)),
                                   double(at / uint64_t(grid.dims.x) % uint64_t(grid.dims.y)),
                                   double(at / (uint64_t(grid.dims.x) * uint64_t(grid.dims.y))));
    samples.opacities.push_back(-std::expm1(-double(extinction)));
  }
  return samples;
}

double shadowPsnr(const Samples& samples, const AttenuationGrid& grid, const std::vector<float>& marched) {
  double squares = 0.0, weights = 0.0;
  for (size_t i = 0; i < samples.voxels.size(); ++i) {
    const double error = double(grid.values[samples.voxels[i]]) / double(AttenuationGrid::kUnit) - double(marched[i]);
    squares += samples.opacities[i] * error * error;
    weights += samples.opacities[i];
  }
  return -10.0 * std::log10(squares / weights);
}

}  // namespace

void addShadows(Table& table, const Scene& scene, const TableOptions& options) {
  if (table.head.empty())
    table.head = {"volume",       "lamp",      "nearest of 26",
                  "interpolated", "corrected", "stored: corrected, near field traced",
                  "swept"};
  std::vector<Classified> ofCode;
  for (uint32_t code = 0; code <= scene.grid.coding.largest; ++code)
    ofCode.push_back(scene.transfer.at(scene.grid.coding.decode(code)));
  const Samples samples = visibleSamples(scene, ofCode);
  const AttenuationFile file = attenuationFile(scene, Classification::preintegrated, options.folders);
  const ClassificationTable classification = classificationTable(scene.transfer, scene.grid.coding);
  const VisibleCubes cubes = findVisibleCubes(scene.grid, scene.transfer);
  const VisibleCubes nearCubes = findNearCubes(scene.grid, CodeVisibility(scene.transfer, scene.grid.coding));
  const CoarseVolume coarse(scene.grid, ofCode);
  const Box box = scene.bounds();
  const double size = glm::length(box.extent());
  const Placement& placement = scene.grid.placement;
  const std::pair<const char*, Towards> lamps[] = {
      {"far, at 0.4, 1, 0.7", Towards::direction(placement, {0.4, 1.0, 0.7})},
      {"far, at -1, 0.25, -0.1", Towards::direction(placement, {-1.0, 0.25, -0.1})},
      {"near, outside", Towards::point(placement, box.centre() + size * glm::dvec3(0.5, 0.35, -0.45))},
      {"inside", Towards::point(placement, box.centre() + 0.2 * box.extent() * glm::dvec3(1.0, 0.8, -0.9))}};
  for (const auto& [name, target] : lamps) {
    const std::vector<float> marched =
        marchTransmittance(scene.grid, scene.transfer, samples.positions, target, kMarchStep);
    const AttenuationGrid swept = sweptAttenuation(scene.grid, classification, cubes, target);
    std::vector<std::string> row = {scene.source.title, name};
    if (target.inside(scene.grid.dims)) {
      row.insert(row.end(), 4, "-");
    } else {
      AttenuationGrid stored = storedAttenuation(file, target, StoredLookup::interpolated);
      row.push_back(
          fmt::format("{:.1f}", shadowPsnr(samples, storedAttenuation(file, target, StoredLookup::nearest), marched)));
      row.push_back(fmt::format("{:.1f}", shadowPsnr(samples, stored, marched)));
      coarse.correct(target, stored);
      row.push_back(fmt::format("{:.1f}", shadowPsnr(samples, stored, marched)));
      row.push_back(fmt::format(
          "{:.1f}",
          shadowPsnr(samples, withNearField(scene.grid, classification, nearCubes, target, kNearPlanes, stored),
                     marched)));
    }
    row.push_back(fmt::format("{:.1f}", shadowPsnr(samples, swept, marched)));
    table.rows.push_back(row);
  }
}

}  // namespace freevoxel::bench
