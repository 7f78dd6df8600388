#include <fmt/core.h>

#include <cmath>

#include "base/error.h"
#include "base/progress.h"
#include "bench/fidelity/measured.h"
#include "bench/fidelity/references.h"
#include "bench/fidelity/tables.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

constexpr int kPositions = 10;

/// Pixels that no correct picture has: not a number, negative, or brighter than the brightest colour.
uint64_t burntPixels(const Image& picture) {
  uint64_t burnt = 0;
  for (size_t i = 0; i < picture.pixels.size(); i += 4) {
    for (size_t channel = 0; channel < 4; ++channel) {
      const float value = picture.pixels[i + channel];
      if (!(value >= 0.0f && value <= 1.001f)) {
        ++burnt;
        break;
      }
    }
  }
  return burnt;
}

/// Pixels that are opaque and black where the reference is not.
uint64_t blackPixels(const Image& picture, const Image& expected) {
  const auto light = [](const Image& image, size_t i) {
    return image.pixels[i] + image.pixels[i + 1] + image.pixels[i + 2];
  };
  uint64_t black = 0;
  for (size_t i = 0; i < picture.pixels.size(); i += 4) {
    if (expected.pixels[i + 3] > 0.5f && light(expected, i) > 0.1f && light(picture, i) < 0.01f) ++black;
  }
  return black;
}

}  // namespace

void addInside(Table& table, const Scene& scene, const TableOptions& options) {
  if (table.head.empty()) table.head = {"volume", "attenuation", "PSNR (worst)", "NaN or burnt pixels", "black pixels"};
  const AttenuationFile file = attenuationFile(scene, Classification::preintegrated, options.folders);
  Splatter splatter(scene.grid, &file, scene.transfer, Backend::cpu);
  for (const AttenuationSource source :
       {AttenuationSource::interpolated, AttenuationSource::quotient, AttenuationSource::swept}) {
    Measured measured;
    uint64_t burnt = 0, black = 0;
    for (const Camera& view : insideViews(scene.bounds(), kPositions, options.imageSize)) {
      SplatOptions splats;
      splats.attenuation = source;
      const Image expected = reference(scene, view, {}, options.folders);
      const Image picture = resolve(splatter.render(view, splats, silentProgress()).sums, splats.formula);
      burnt += burntPixels(picture);
      black += blackPixels(picture, expected);
      measured.add(compareImages(picture, expected));
    }
    table.rows.push_back({scene.source.title, std::string(attenuationSourceName(source)), measured.text(),
                          fmt::format("{}", burnt), fmt::format("{}", black)});
  }
}

}  // namespace freevoxel::bench
