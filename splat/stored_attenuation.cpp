#include <algorithm>
#include <array>
#include <cmath>
#include <glm/glm.hpp>

#include "hierarchy/direction_lookup.h"
#include "splat/attenuation_grid.h"
#include "splat/volume_view.h"

namespace freevoxel {

namespace {

/// code -> (code / 255)^power for powers between two, linear in the power.
class PowerTable {
 public:
  void prepare(float low, float high) {
    low_ = low;
    scale_ = high > low ? 1.0f / (high - low) : 0.0f;
    for (int code = 1; code < 256; ++code) {
      const float log = std::log(float(code) / 255.0f);
      atLow_[size_t(code)] = std::exp(low * log);
      difference_[size_t(code)] = std::exp(high * log) - atLow_[size_t(code)];
    }
  }
  float operator()(uint8_t code, float power) const {
    return atLow_[code] + (power - low_) * scale_ * difference_[code];
  }

 private:
  float low_ = 1.0f, scale_ = 0.0f;
  std::array<float, 256> atLow_{}, difference_{};
};

float lengthPerPlane(const Towards& towards, glm::dvec3 u) {
  const double largest = std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)});
  return largest > 0.0 ? float(glm::length(towards.lengthFromIndex * u) / largest) : 1.0f;
}

AttenuationGrid nearestAttenuation(const AttenuationFile& file, const Towards& towards) {
  const glm::ivec3 dims = file.dims();
  AttenuationGrid result;
  result.values.assign(voxelCount(dims), 65535);
  const int64_t bricks = int64_t(file.brickCount());
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t b = 0; b < bricks; ++b) {
    const BrickView brick = file.brick(size_t(b));
    for (size_t step = 0; step < brick.curve.size(); ++step) {
      const glm::ivec3 p = brick.origin + glm::ivec3(brick.curve[step].x, brick.curve[step].y, brick.curve[step].z);
      if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) continue;
      const int nearest =
          nearestDirection(towards.lengthFromIndex, towards.lengthFromIndex * towards.from(glm::dvec3(p)));
      result.values[linearIndex(p, dims)] = uint16_t(257 * brick.attenuations[nearest][step]);  // 255 -> 65535
    }
  }
  return result;
}

/// Powers within a brick differ so little beyond this distance that the table is linear to a thousandth of a code.
constexpr double kNearBricks = 4.0;

}  // namespace

Towards Towards::point(const Placement& placement, glm::dvec3 world) {
  Towards towards;
  towards.index = glm::dvec3(glm::inverse(placement.worldFromIndex()) * glm::dvec4(world, 1.0));
  for (int axis = 0; axis < 3; ++axis) {
    towards.lengthFromIndex[axis] = placement.direction[axis] * (placement.spacing[axis] / placement.unitLength());
  }
  return towards;
}

Towards Towards::direction(const Placement& placement, glm::dvec3 world) {
  Towards towards = point(placement, world);
  towards.directional = true;
  towards.index = glm::inverse(towards.lengthFromIndex) * world;
  return towards;
}

AttenuationGrid storedAttenuation(const AttenuationFile& file, const Towards& towards, StoredLookup lookup) {
  if (lookup == StoredLookup::nearest) return nearestAttenuation(file, towards);
  const glm::ivec3 dims = file.dims();
  AttenuationGrid result;
  result.values.assign(voxelCount(dims), 65535);
  const int64_t bricks = int64_t(file.brickCount());
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t b = 0; b < bricks; ++b) {
    const BrickView brick = file.brick(size_t(b));
    const glm::dvec3 first(brick.origin), last = first + double(brick.edge - 1);
    const DirectionTriangle triangle = directionTriangle(towards.from(0.5 * (first + last)));
    bool uniform = towards.directional;
    float low = lengthPerPlane(towards, towards.from(first)), high = low;
    if (!uniform) {
      uniform = glm::length(towards.from(0.5 * (first + last))) > kNearBricks * brick.edge;
      for (int corner = 0; corner < 8; ++corner) {
        const glm::dvec3 u = towards.from(
            {(corner & 1) ? last.x : first.x, (corner & 2) ? last.y : first.y, (corner & 4) ? last.z : first.z});
        uniform = uniform && directionTriangle(u) == triangle;
        const float power = lengthPerPlane(towards, u);
        low = std::min(low, power);
        high = std::max(high, power);
      }
    }
    PowerTable table;
    if (uniform) table.prepare(low, high);
    for (size_t step = 0; step < brick.curve.size(); ++step) {
      const glm::ivec3 p = brick.origin + glm::ivec3(brick.curve[step].x, brick.curve[step].y, brick.curve[step].z);
      if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) continue;
      const glm::dvec3 u = towards.from(glm::dvec3(p));
      float attenuation = 0.0f;
      const DirectionTriangle own = uniform ? triangle : directionTriangle(u);
      if (u == glm::dvec3(0.0)) {
        attenuation = 1.0f;  // the target's own voxel
      } else {
        const std::array<float, 3> weights = directionWeights(own, u);
        const float power = lengthPerPlane(towards, u);
        for (size_t k = 0; k < 3; ++k) {
          const uint8_t code = brick.attenuations[own.index[k]][step];
          attenuation += weights[k] * (uniform ? table(code, power) : std::pow(float(code) / 255.0f, power));
        }
      }
      result.values[linearIndex(p, dims)] =
          uint16_t(std::clamp(attenuation, 0.0f, 1.0f) * AttenuationGrid::kUnit + 0.5f);
    }
  }
  return result;
}

}  // namespace freevoxel
