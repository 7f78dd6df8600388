#include "splat/stored_attenuation.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "base/first_exception.h"
#include "hierarchy/direction_lookup.h"
#include "splat/volume_view.h"

namespace freevoxel {

namespace {

/// code -> (code / 255)^power for powers between two, linear in the power.
class PowerTable {
 public:
  PowerTable(float low, float high) : low_(low), scale_(high > low ? 1.0f / (high - low) : 0.0f) {
    for (int code = 1; code < 256; ++code) {
      const float log = std::log(float(code) / 255.0f);
      atLow_[size_t(code)] = std::exp(low * log);
      difference_[size_t(code)] = std::exp(high * log) - atLow_[size_t(code)];
    }
  }
  /// How far a power is from low to high, 0..1.
  float share(float power) const { return (power - low_) * scale_; }
  float operator()(uint8_t code, float share) const { return atLow_[code] + share * difference_[code]; }

 private:
  float low_, scale_;
  std::array<float, 256> atLow_{}, difference_{};
};

float lengthPerPlane(const Towards& towards, glm::dvec3 u) {
  const double largest = std::max({std::abs(u.x), std::abs(u.y), std::abs(u.z)});
  return largest > 0.0 ? float(glm::length(towards.lengthFromIndex * u) / largest) : 1.0f;
}

glm::ivec3 localPosition(const BrickView& brick, size_t step) {
  return {brick.curve[step].x, brick.curve[step].y, brick.curve[step].z};
}

DirectionSet directionsOf(const DirectionTriangle& triangle) {
  DirectionSet set = 0;
  for (const int direction : triangle.index)
    set |= DirectionSet(1) << direction;
  return set;
}

/// Powers within a brick differ so little beyond this distance that the table is linear to a thousandth of a code.
constexpr double kNearBricks = 4.0;

}  // namespace

StoredAttenuation::StoredAttenuation(const AttenuationFile& file, const Towards& towards, StoredLookup lookup,
                                     int level)
    : file_(file),
      towards_(towards.ofLevel(level)),
      lookup_(lookup),
      squaredLength_(glm::transpose(towards.lengthFromIndex) * towards.lengthFromIndex) {
  if (lookup != StoredLookup::quotient || !towards.inside(file.dims())) return;
  const glm::ivec3 voxel = glm::clamp(glm::ivec3(glm::round(towards.index)), glm::ivec3(0), file.dims() - 1);
  const std::optional<size_t> found = file.findBrick(voxel / file.brickEdge());
  if (!found) return;
  const BrickView brick = file.brick(*found);
  const glm::ivec3 local = voxel - brick.origin;
  const size_t step = brick.steps[size_t((local.z * brick.edge + local.y) * brick.edge + local.x)];
  atTarget_.emplace();
  for (size_t k = 0; k < atTarget_->size(); ++k)
    (*atTarget_)[k] = brick.attenuations[k][step];
}

int StoredAttenuation::nearest(glm::dvec3 voxel) const {
  return nearestDirection(towards_.lengthFromIndex, towards_.lengthFromIndex * towards_.from(voxel));
}

DirectionSet StoredAttenuation::directions(glm::ivec3 first) const {
  if (file_.layout() == Layout::dense) return kAllDirections;  // they cost nothing there
  // Voxels of the brick beyond the volume are looked up too.
  const glm::ivec3 last = first + (file_.brickEdge() - 1);
  const auto needed = [&](glm::dvec3 voxel) {
    return lookup_ == StoredLookup::nearest ? DirectionSet(1) << nearest(voxel)
                                            : directionsOf(directionTriangle(towards_.from(voxel)));
  };
  DirectionSet set = 0;
  if (towards_.directional) return needed(glm::dvec3(first));
  if (lookup_ != StoredLookup::nearest) {
    // Octant triangles are convex: where all corners lie in one, so does what is between.
    bool one = true;
    for (int corner = 0; corner < 8; ++corner) {
      const DirectionSet here =
          needed({(corner & 1) ? last.x : first.x, (corner & 2) ? last.y : first.y, (corner & 4) ? last.z : first.z});
      one = one && (set == 0 || set == here);
      set |= here;
    }
    if (one) return set;
  }
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x)
        set |= needed(glm::dvec3(x, y, z));
    }
  }
  return set;
}

void StoredAttenuation::look(const BrickView& brick, std::span<float> attenuation) const {
  checkEqual(attenuation.size(), brick.curve.size(), "voxels of a brick");
  if (lookup_ == StoredLookup::nearest) return lookNearest(brick, attenuation);
  const glm::dvec3 first(brick.origin), last = first + double(brick.edge - 1);
  const DirectionTriangle triangle = directionTriangle(towards_.from(0.5 * (first + last)));
  const uint8_t* planes[3];
  for (size_t k = 0; k < 3; ++k)
    planes[k] = brick.attenuations[triangle.index[k]];
  if (towards_.directional) {
    // One power, one set of weights: three tables.
    const float power = lengthPerPlane(towards_, towards_.index);
    const PowerTable table(power, power);
    const std::array<float, 3> weights = directionWeights(triangle, towards_.index);
    std::array<std::array<float, 256>, 3> weighted;
    for (size_t k = 0; k < 3; ++k) {
      for (size_t code = 0; code < 256; ++code)
        weighted[k][code] = weights[k] * table(uint8_t(code), 0.0f);
    }
    for (size_t step = 0; step < attenuation.size(); ++step)
      attenuation[step] = weighted[0][planes[0][step]] + weighted[1][planes[1][step]] + weighted[2][planes[2][step]];
    return;
  }
  float low = lengthPerPlane(towards_, towards_.from(first)), high = low;
  bool uniform = !atTarget_ && glm::length(towards_.from(0.5 * (first + last))) > kNearBricks * brick.edge;
  for (int corner = 0; corner < 8 && uniform; ++corner) {
    const glm::dvec3 u = towards_.from(
        {(corner & 1) ? last.x : first.x, (corner & 2) ? last.y : first.y, (corner & 4) ? last.z : first.z});
    uniform = directionTriangle(u) == triangle;
    const float power = lengthPerPlane(towards_, u);
    low = std::min(low, power);
    high = std::max(high, power);
  }
  if (!uniform) return lookOneByOne(brick, attenuation);
  const PowerTable table(low, high);
  const glm::vec3 fromFirst(towards_.from(first));
  const glm::mat3 squaredLength(squaredLength_);
  const int a = triangle.axis[0], b = triangle.axis[1], c = triangle.axis[2];
  for (size_t step = 0; step < attenuation.size(); ++step) {
    const glm::vec3 u = fromFirst - glm::vec3(localPosition(brick, step));
    const float perLargest = 1.0f / std::abs(u[a]);
    const float toB = std::abs(u[b]) * perLargest, toC = std::abs(u[c]) * perLargest;
    const float share = table.share(std::sqrt(glm::dot(u, squaredLength * u)) * perLargest);
    const float value = (1.0f - toB) * table(planes[0][step], share) + (toB - toC) * table(planes[1][step], share) +
                        toC * table(planes[2][step], share);
    attenuation[step] = std::clamp(value, 0.0f, 1.0f);
  }
}

void StoredAttenuation::lookNearest(const BrickView& brick, std::span<float> attenuation) const {
  for (size_t step = 0; step < attenuation.size(); ++step) {
    const int direction = nearest(glm::dvec3(brick.origin + localPosition(brick, step)));
    attenuation[step] = float(brick.attenuations[direction][step]) * (1.0f / 255.0f);
  }
}

float StoredAttenuation::divisor(glm::dvec3 u) const {
  const DirectionTriangle triangle = directionTriangle(u);
  const std::array<float, 3> weights = directionWeights(triangle, u);
  const float power = lengthPerPlane(towards_, u);
  float sum = 0.0f;
  for (size_t k = 0; k < 3; ++k)
    sum += weights[k] * std::pow(float((*atTarget_)[size_t(triangle.index[k])]) / 255.0f, power);
  return sum;
}

void StoredAttenuation::lookOneByOne(const BrickView& brick, std::span<float> attenuation) const {
  for (size_t step = 0; step < attenuation.size(); ++step) {
    const glm::dvec3 u = towards_.from(glm::dvec3(brick.origin + localPosition(brick, step)));
    if (u == glm::dvec3(0.0)) {
      attenuation[step] = 1.0f;  // the target's own voxel
      continue;
    }
    const DirectionTriangle triangle = directionTriangle(u);
    const std::array<float, 3> weights = directionWeights(triangle, u);
    const float power = lengthPerPlane(towards_, u);
    float sum = 0.0f;
    for (size_t k = 0; k < 3; ++k)
      sum += weights[k] * std::pow(float(brick.attenuations[triangle.index[k]][step]) / 255.0f, power);
    if (atTarget_) {
      const float below = divisor(u);
      sum = below > sum ? sum / below : 1.0f;
    }
    attenuation[step] = std::clamp(sum, 0.0f, 1.0f);
  }
}

AttenuationGrid storedAttenuation(const AttenuationFile& file, const Towards& towards, StoredLookup lookup) {
  const glm::ivec3 dims = file.dims();
  const StoredAttenuation stored(file, towards, lookup);
  AttenuationGrid result;
  result.values.assign(voxelCount(dims), uint16_t(AttenuationGrid::kUnit));
  result.setOpenFaces(towards, dims);
  const auto lookUpBrick = [&](size_t b) {
    const BrickView brick = file.brick(b, stored.directions(file.brickOrigin(b)));
    std::vector<float> attenuation(brick.curve.size());
    stored.look(brick, attenuation);
    for (size_t step = 0; step < attenuation.size(); ++step) {
      const glm::ivec3 p = brick.origin + localPosition(brick, step);
      if (p.x >= dims.x || p.y >= dims.y || p.z >= dims.z) continue;
      result.values[linearIndex(p, dims)] = uint16_t(attenuation[step] * AttenuationGrid::kUnit + 0.5f);
    }
    file.checkIntact();
  };
  FirstException failure;
#pragma omp parallel for schedule(dynamic, 4)
  for (int64_t b = 0; b < int64_t(file.brickCount()); ++b)
    failure.guard([&] { lookUpBrick(size_t(b)); });
  failure.rethrow();
  return result;
}

}  // namespace freevoxel
