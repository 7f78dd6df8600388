// The lamps of a picture, from the command line.
#pragma once

#include <optional>

#include "app/options.h"
#include "base/light.h"

namespace freevoxel {

struct LightOptions {
  std::vector<Light> lights;
  std::optional<double> ambient;
  Shading shading = Shading::none;
};

void addLightOptions(CLI::App& command, LightOptions& options);

/// Lighting they describe: without any of them every voxel shines with its own colour; with lamps, and no --ambient, a
/// little light reaches everything.
Lighting makeLighting(const LightOptions& options);

}  // namespace freevoxel
