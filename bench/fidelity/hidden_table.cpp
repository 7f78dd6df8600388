#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "base/progress.h"
#include "bench/fidelity/measured.h"
#include "bench/fidelity/tables.h"
#include "splat/splat.h"

namespace freevoxel::bench {

namespace {

constexpr int kViews = 6;

float largestAlphaChange(const Image& a, const Image& b) {
  float largest = 0.0f;
  for (size_t i = 3; i < a.pixels.size(); i += 4)
    largest = std::max(largest, std::abs(a.pixels[i] - b.pixels[i]));
  return largest;
}

}  // namespace

void addHidden(Table& table, const Scene& scene, const TableOptions& options) {
  if (table.head.empty()) {
    table.head = {"volume",
                  "attenuation",
                  "culled against not (worst)",
                  "largest change of alpha",
                  "pieces of rays left out",
                  "visible ones left out",
                  "blocks left out",
                  "draw time"};
  }
  const AttenuationFile file = attenuationFile(scene, Classification::preintegrated, options.folders);
  Splatter splatter(scene.grid, &file, scene.transfer, Backend::cpu);
  for (const AttenuationSource source :
       {AttenuationSource::interpolated, AttenuationSource::stored, AttenuationSource::swept}) {
    Measured measured;
    float alpha = 0.0f;
    uint64_t pieces = 0, allPieces = 0, visible = 0, allVisible = 0, hidden = 0, blocks = 0;
    double seconds = 0.0, allSeconds = 0.0;
    for (const Camera& view : randomViews(scene.bounds(), std::min(kViews, options.views), options.imageSize)) {
      SplatOptions splats;
      splats.attenuation = source;
      splatter.render(view, splats, silentProgress());  // bricks and blocks then have their memory
      const SplatResult all = splatter.render(view, splats, silentProgress());
      splats.cull = Cull::hidden;
      const SplatResult culled = splatter.render(view, splats, silentProgress());
      const Image expected = resolve(all.sums, splats.formula), picture = resolve(culled.sums, splats.formula);
      measured.add(compareImages(picture, expected));
      alpha = std::max(alpha, largestAlphaChange(picture, expected));
      allPieces += all.statistics.pieces;
      pieces += culled.statistics.pieces;
      allVisible += all.statistics.visiblePieces;
      visible += culled.statistics.visiblePieces;
      blocks += all.statistics.blocks;
      hidden += culled.statistics.hiddenBlocks;
      allSeconds += all.statistics.drawSeconds;
      seconds += culled.statistics.drawSeconds;
    }
    table.rows.push_back({scene.source.title, std::string(attenuationSourceName(source)), measured.text(),
                          fmt::format("{:.4f}", alpha),
                          fmt::format("{:.0f} %", 100.0 * (1.0 - double(pieces) / double(allPieces))),
                          fmt::format("{:.0f} %", 100.0 * (1.0 - double(visible) / double(allVisible))),
                          fmt::format("{:.0f} %", 100.0 * double(hidden) / double(blocks)),
                          fmt::format("x {:.2f}", seconds / allSeconds)});
  }
}

}  // namespace freevoxel::bench
