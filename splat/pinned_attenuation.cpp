#include "splat/pinned_attenuation.h"

#include <algorithm>
#include <bit>
#include <glm/glm.hpp>
#include <vector>

#include "base/first_exception.h"
#include "precompute/hilbert.h"
#include "precompute/pin_writer.h"
#include "precompute/stored_bricks.h"

namespace freevoxel {

namespace {

/// Whoever types a direction writes nine digits of it; no sweep shows the tenth.
constexpr double kSame = 1e-9;

}  // namespace

uint64_t pinAttenuation(const std::string& source, std::span<const Pin> pins, const std::string& path,
                        Progress& progress) {
  const AttenuationFile file(source);
  const ValueGrid grid = valueGrid(file);
  const ClassificationTable table = classificationTable(file.transfer(), grid.coding);
  const VisibleCubes cubes = findVisibleCubes(grid, file.transfer());
  PinWriter writer(source, path, pins);
  progress.begin("pinning", pins.size(), "pins");
  for (const Pin& pin : pins) {
    writer.add(sweptAttenuation(grid, table, cubes, towardsPin(pin, grid.placement)).values);
    progress.advance(1);
  }
  progress.end();
  return writer.commit();
}

Towards towardsPin(const Pin& pin, const Placement& placement) {
  return pin.directional ? Towards::direction(placement, pin.world) : Towards::point(placement, pin.world);
}

std::optional<size_t> findPin(const AttenuationFile& file, const Towards& target) {
  const std::vector<Pin>& pins = file.pinned().pins();
  for (size_t i = 0; i < pins.size(); ++i) {
    if (pins[i].directional != target.directional) continue;
    const glm::dvec3 pin = towardsPin(pins[i], file.placement()).index;
    const glm::dvec3 difference =
        target.directional ? glm::normalize(pin) - glm::normalize(target.index) : pin - target.index;
    const double size = target.directional ? 1.0 : std::max(1.0, glm::length(pin));
    if (glm::length(difference) <= kSame * size) return i;
  }
  return std::nullopt;
}

AttenuationGrid pinnedAttenuation(const AttenuationFile& file, size_t pin) {
  const glm::ivec3 dims = file.dims();
  const int edge = file.brickEdge();
  const glm::ivec3 bricks = brickDims(dims, edge);
  const int curveOrder = brickCurveOrder(dims, edge), brickOrder = std::countr_zero(unsigned(edge));
  AttenuationGrid result;
  result.values.resize(voxelCount(dims));
  result.setOpenFaces(towardsPin(file.pinned().pins()[pin], file.placement()), dims);
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 8)
  for (int64_t i = 0; i < int64_t(voxelCount(bricks)); ++i) {
    failure.guard([&] {
      const glm::ivec3 position(int(i % bricks.x), int(i / bricks.x % bricks.y),
                                int(i / (int64_t(bricks.x) * bricks.y)));
      const auto steps = hilbertSteps(hilbertState(position, curveOrder), brickOrder);
      std::vector<uint16_t> values(steps.size());
      file.pinned().unpack(pin, position, values);
      const glm::ivec3 origin = position * edge, extent = brickExtent(position, dims, edge);
      for (int z = 0; z < extent.z; ++z) {
        for (int y = 0; y < extent.y; ++y) {
          uint16_t* row = result.values.data() + linearIndex(origin + glm::ivec3(0, y, z), dims);
          const uint16_t* rowSteps = steps.data() + (z * edge + y) * edge;
          for (int x = 0; x < extent.x; ++x)
            row[x] = values[rowSteps[x]];
        }
      }
      file.checkIntact();
    });
  }
  failure.rethrow();
  return result;
}

}  // namespace freevoxel
