// The volumes that pictures are judged by, each with the transfer function that it is shown with.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/camera.h"
#include "hierarchy/attenuation_file.h"
#include "hierarchy/value_grid.h"
#include "precompute/format.h"
#include "volume/transfer_function.h"

namespace freevoxel::bench {

struct Folders {
  std::string data;       ///< the real volumes: volumes/...
  std::string transfers;  ///< examples/transfer
  std::string cache;      ///< attenuation files and references are kept here from run to run
};

/// One column of the tables: where a scene comes from.
struct SceneSource {
  std::string name;      ///< as on the command line, and of cached files
  std::string title;     ///< as in a table
  std::string kind;      ///< of a procedural volume, or empty
  std::string file;      ///< of a real one, below Folders::data
  std::string transfer;  ///< file name in Folders::transfers
  bool real() const { return kind.empty(); }
};

/// All columns, in the order of the tables.
const std::vector<SceneSource>& sceneSources();

struct Scene {
  SceneSource source;
  TransferFunction transfer;
  Volume volume;
  ValueGrid grid;
  uint64_t hash = 0;  ///< of values, sizes and transfer function

  Box bounds() const { return worldBounds(grid.placement, grid.dims); }
};

/// Null if the file of a real volume is not there.
std::unique_ptr<Scene> loadScene(const SceneSource& source, const Folders& folders);

/// The attenuation file of a scene, precomputed unless the cache has it.
AttenuationFile attenuationFile(const Scene& scene, Classification classification, const Folders& folders);

/// Perspective cameras at fixed pseudo-random places on a sphere round the box, framed to fit. The first `count` of an
/// endless row.
std::vector<Camera> randomViews(const Box& box, int count, glm::ivec2 imageSize);

/// Eyes at fixed pseudo-random places inside the box, each looking a random way with a wide angle.
std::vector<Camera> insideViews(const Box& box, int count, glm::ivec2 imageSize);

}  // namespace freevoxel::bench
