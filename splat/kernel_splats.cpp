#include "splat/kernel_splats.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>
#include <utility>

#include "base/grid.h"
#include "splat/attenuation_grid.h"

namespace freevoxel {

namespace {

/// A splat is never narrower than the kernel of one pixel, whose samples at the pixel centres add up to 1: a smaller
/// one would fall between them. Smallest eigenvalue of a splat's shape, in square pixels.
constexpr double kSmallestShape = 1.0;

/// Splats outside the image are stretched no more than those this many times as far off the axis as its rim: the affine
/// picture of a voxel beside the eye would otherwise sweep over the whole image.
constexpr double kLargestShear = 1.3;

/// Symmetric 2 x 2 matrix.
struct Shape {
  double xx, xy, yy;
  double determinant() const { return xx * yy - xy * xy; }
  double smallestEigenvalue() const {
    const double mean = 0.5 * (xx + yy);
    const double difference = 0.5 * (xx - yy);
    return mean - std::sqrt(difference * difference + xy * xy);
  }
};

}  // namespace

KernelSetup::KernelSetup(const VolumeView& view, std::vector<Classified> classified, KernelEmission emission,
                         float quantum, float hiddenBelow)
    : view_(view),
      classified_(std::move(classified)),
      emission_(emission),
      inverseQuantum_(1.0f / quantum),
      hiddenBelow_(hiddenBelow) {
  orthographicPower_ = lengthPerPlane(glm::dvec3(0.0, 0.0, 1.0));
  const glm::dmat3& edges = view_.viewFromIndex;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      cellDiagonal_ = std::max(cellDiagonal_, glm::length(x * edges[0] + y * edges[1] + edges[2]));
    }
  }
  // No half axis of the kernel's ellipsoid is longer than the root of the edges' squares.
  kernelReach_ = double(shared::kKernelRadius) *
                 std::sqrt(glm::dot(edges[0], edges[0]) + glm::dot(edges[1], edges[1]) + glm::dot(edges[2], edges[2]));
}

float KernelSetup::lengthPerPlane(glm::dvec3 towards) const {
  const glm::dvec3 omega = glm::abs(view_.indexFromView * towards);
  return float(1.0 / std::max({omega.x, omega.y, omega.z}));
}

Classified KernelSetup::classify(const BlockSamples& samples, size_t at) const {
  if (samples.matter.empty()) return classified_[samples.codes[at]];
  const TableEntry& matter = samples.matter[at];
  Classified voxel{};
  if (!(matter.extinction > 0.0f)) return voxel;
  voxel.linear = glm::vec3(matter.red, matter.green, matter.blue) / matter.extinction;
  voxel.extinction = matter.extinction * std::numbers::ln2_v<float>;
  return voxel;
}

template <class Keep>
void KernelSetup::forEachSplat(const BlockSamples& samples, const VisibleBlock& block, glm::ivec3 dims, int edge,
                               Counts& counts, Keep&& keep) const {
  const glm::ivec3 last = glm::min(block.origin + edge, dims);
  for (int z = block.origin.z; z < last.z; ++z) {
    for (int y = block.origin.y; y < last.y; ++y) {
      const glm::ivec3 first(block.origin.x, y, z);
      uint64_t at = linearIndex(first - block.origin + 1, glm::ivec3(blockSide(edge)));
      for (int x = block.origin.x; x < last.x; ++x, ++at) {
        const Classified voxel = classify(samples, at);
        if (voxel.extinction <= 0.0f) continue;
        const float reaching = float(samples.attenuations[at]) * (1.0f / AttenuationGrid::kUnit);
        if (reaching < hiddenBelow_) {
          ++counts.hiddenSplats;
          continue;
        }
        KernelSplat splat;
        if (!makeSplat({x, y, z}, voxel, reaching, splat, counts)) {
          ++counts.culledSplats;
          continue;
        }
        if (!samples.lights.empty()) {
          splat.emissionR *= float(samples.lights[at].red) * (1.0f / LightGrid::kUnit);
          splat.emissionG *= float(samples.lights[at].green) * (1.0f / LightGrid::kUnit);
          splat.emissionB *= float(samples.lights[at].blue) * (1.0f / LightGrid::kUnit);
        }
        keep(splat, glm::ivec3(x, y, z));
      }
    }
  }
}

void KernelSetup::append(const BlockSamples& samples, const VisibleBlock& block, glm::ivec3 dims, int edge,
                         std::vector<KernelSplat>& splats, Counts& counts) const {
  forEachSplat(samples, block, dims, edge, counts,
               [&](const KernelSplat& splat, glm::ivec3) { splats.push_back(splat); });
}

void KernelSetup::appendWithDistance(const BlockSamples& samples, const VisibleBlock& block, glm::ivec3 dims, int edge,
                                     std::vector<BlendSplat>& splats, Counts& counts) const {
  forEachSplat(samples, block, dims, edge, counts, [&](const KernelSplat& splat, glm::ivec3 voxel) {
    const glm::dvec3 position = view_.viewPosition(glm::dvec3(voxel));
    splats.push_back({splat, float(view_.orthographic ? -position.z : glm::length(position))});
  });
}

bool KernelSetup::makeSplat(glm::ivec3 index, const Classified& voxel, float attenuation, KernelSplat& splat,
                            Counts& counts) const {
  const double scale = view_.pixelsPerUnit;
  const glm::dvec2 largestSlope = kLargestShear * 0.5 * glm::dvec2(view_.imageSize) / scale;
  const glm::dvec3 position = view_.viewPosition(glm::dvec3(index));
  const double depth = -position.z;

  // Where the voxel lands, and the edges of its cell projected there: columns of the local affine map.
  double pixelsPerEdge = scale;
  double slopeX = 0.0, slopeY = 0.0;
  double distancePerDepth = 1.0;  // 1 / cos of the angle off the axis
  glm::dvec3 towardsEye(0.0, 0.0, 1.0);
  if (view_.orthographic) {
    if (depth < 0.0) return false;
  } else {
    if (depth < kNearestKernel) return false;
    pixelsPerEdge = scale / depth;
    slopeX = position.x / depth;
    slopeY = position.y / depth;
    const double distance = glm::length(position);
    distancePerDepth = distance / depth;
    towardsEye = position / -distance;
  }
  Shape shape{0.0, 0.0, 0.0};
  const double shearX = std::clamp(slopeX, -largestSlope.x, largestSlope.x);
  const double shearY = std::clamp(slopeY, -largestSlope.y, largestSlope.y);
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 edge = view_.viewFromIndex[axis];
    const double x = pixelsPerEdge * (edge.x + shearX * edge.z);
    const double y = -pixelsPerEdge * (edge.y + shearY * edge.z);
    shape.xx += x * x;
    shape.xy += x * y;
    shape.yy += y * y;
  }
  const double widening = std::max(0.0, kSmallestShape - shape.smallestEigenvalue());
  shape.xx += widening;
  shape.yy += widening;

  const double perspectiveX = view_.orthographic ? position.x * scale : slopeX * scale;
  const double perspectiveY = view_.orthographic ? position.y * scale : slopeY * scale;
  splat.centreX = float(view_.centre.x + perspectiveX);
  splat.centreY = float(view_.centre.y - perspectiveY);
  const double radius = double(shared::kKernelRadius);
  splat.extentX = float(radius * std::sqrt(shape.xx));
  splat.extentY = float(radius * std::sqrt(shape.yy));
  const int x0 = int(std::max(0.0f, std::floor(splat.centreX - splat.extentX)));
  const int y0 = int(std::max(0.0f, std::floor(splat.centreY - splat.extentY)));
  const int x1 = int(std::min(float(view_.imageSize.x), std::ceil(splat.centreX + splat.extentX)));
  const int y1 = int(std::min(float(view_.imageSize.y), std::ceil(splat.centreY + splat.extentY)));
  if (x0 >= x1 || y0 >= y1) return false;
  counts.fragments += uint64_t(x1 - x0) * uint64_t(y1 - y0);

  const double determinant = shape.determinant();
  const double rim = 1.0 / (determinant * radius * radius);
  splat.conicXX = float(shape.yy * rim);
  splat.conicXY = float(-2.0 * shape.xy * rim);
  splat.conicYY = float(shape.xx * rim);

  // The weight, a length, integrates over the image to V f^2 / (z^2 cos t).
  const float length =
      float(view_.voxelVolume * pixelsPerEdge * pixelsPerEdge * distancePerDepth / std::sqrt(determinant));
  splat.depth64 = 64.0f * voxel.extinction * length;
  float light = attenuation * inverseQuantum_;
  if (emission_ == KernelEmission::opacity) {
    light *= -std::expm1(-voxel.extinction) * length;
  } else {
    // Every plane of voxels takes exactly 1 - T^l, so that a slab telescopes.
    const float power = view_.orthographic ? orthographicPower_ : lengthPerPlane(towardsEye);
    light *= -std::expm1(-voxel.extinction * power);
    if (emission_ == KernelEmission::telescoping) light *= length / power;
  }
  splat.emissionR = voxel.linear.r * light;
  splat.emissionG = voxel.linear.g * light;
  splat.emissionB = voxel.linear.b * light;
  splat.emissionO = light;
  return true;
}

bool KernelSetup::mayTouchImage(glm::ivec3 origin, int edge) const {
  const double halfEdge = 0.5 * double(edge - 1);
  const glm::dvec3 centre = view_.viewPosition(glm::dvec3(origin) + halfEdge);
  const double blockRadius = halfEdge * cellDiagonal_;
  const double depth = -centre.z;
  const glm::dvec2 half = 0.5 * glm::dvec2(view_.imageSize) + double(shared::kKernelRadius) + 1.0;  // widened splats
  if (view_.orthographic) {
    const glm::dvec2 reach = half + (blockRadius + kernelReach_) * view_.pixelsPerUnit;
    return depth + blockRadius >= 0.0 && std::abs(centre.x) * view_.pixelsPerUnit <= reach.x &&
           std::abs(centre.y) * view_.pixelsPerUnit <= reach.y;
  }
  if (depth + blockRadius < kNearestKernel) return false;
  for (int axis = 0; axis < 2; ++axis) {
    const double slope = half[axis] / view_.pixelsPerUnit;
    const double outside = (std::abs(centre[axis]) - slope * depth) / std::sqrt(1.0 + slope * slope);
    // Shearing widens a footprint by at most (1 + 1.3 slope) / sqrt(1 + slope^2) < 1.7.
    if (outside > blockRadius + 1.7 * kernelReach_) return false;
  }
  return true;
}

}  // namespace freevoxel
