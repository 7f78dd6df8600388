// The tables of docs/results/fidelity.md. Each function measures one scene and adds its column, or its row.
#pragma once

#include <string>

#include "bench/fidelity/scenes.h"
#include "bench/fidelity/table.h"

namespace freevoxel::bench {

struct TableOptions {
  Folders folders;
  int views = 20;
  glm::ivec2 imageSize{512, 512};
  std::vector<std::string> rows;  ///< of quality: only those whose name holds one of these; all if empty
};

/// Casts what addQuality compares with, as far as the cache lacks it.
void castReferences(const Scene& scene, const TableOptions& options);

/// PSNR against the post-classified and the pre-classified reference, of every formula, footprint and source of
/// attenuation: a column.
struct QualityTables {
  Table post, pre;
  Table bars;  ///< a row per scene: how far cells are above or below what they are measured by
};
void addQuality(QualityTables& tables, const Scene& scene, const TableOptions& options);

/// Transmittance towards lamps against a marched one, weighted by opacity: a row.
void addShadows(Table& table, const Scene& scene, const TableOptions& options);

/// The eye inside the volume, by source of attenuation: a row.
void addInside(Table& table, const Scene& scene, const TableOptions& options);

/// Culling what is hidden, against not culling: a row.
void addHidden(Table& table, const Scene& scene, const TableOptions& options);

/// Frame time over the number of lamps: a row.
void addLights(Table& table, const Scene& scene, const TableOptions& options);

}  // namespace freevoxel::bench
