// Procedural volumes with exact geometry.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <glm/glm.hpp>
#include <numbers>

#include "volume/procedural_kinds.h"

namespace freevoxel {

namespace {

/// The generator of a field: `value(x, y, z)` of a voxel, as a T.
template <class T, class F>
SliceGenerator eachVoxel(glm::ivec3 dims, F value) {
  return [dims, value](int z, std::byte* out) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x, out += sizeof(T)) {
        const T v = value(glm::ivec3(x, y, z));
        std::memcpy(out, &v, sizeof(T));
      }
    }
  };
}

/// Centre of a voxel, the whole box being -1..1.
glm::dvec3 inBox(glm::ivec3 voxel, glm::ivec3 dims) {
  return (2.0 * glm::dvec3(voxel) + 1.0) / glm::dvec3(dims) - 1.0;
}

/// Centre of a voxel, the outermost centres being 0 and 1 (0.5 along an axis of one voxel).
glm::dvec3 betweenEnds(glm::ivec3 voxel, glm::ivec3 dims) {
  glm::dvec3 position(0.5);
  for (int axis = 0; axis < 3; ++axis) {
    if (dims[axis] > 1) position[axis] = double(voxel[axis]) / (dims[axis] - 1);
  }
  return position;
}

/// An ellipsoid of the phantom; the whole box is -1..1. Turned about z.
struct Ellipsoid {
  int value;  ///< added inside
  glm::dvec3 radii, centre;
  double cosine, sine;
};

constexpr double kCos18 = 0.9510565162951535;
constexpr double kSin18 = 0.3090169943749474;

/// Shepp and Logan (1974) as Kak and Slaney and, for the contrast, Toft (1996) give it, carried on to three dimensions.
const std::array<Ellipsoid, 10> kPhantom{{
    {1000, {0.69, 0.92, 0.81}, {0.0, 0.0, 0.0}, 1.0, 0.0},
    {-800, {0.6624, 0.874, 0.78}, {0.0, -0.0184, 0.0}, 1.0, 0.0},
    {-200, {0.11, 0.31, 0.22}, {0.22, 0.0, 0.0}, kCos18, -kSin18},
    {-200, {0.16, 0.41, 0.28}, {-0.22, 0.0, 0.0}, kCos18, kSin18},
    {100, {0.21, 0.25, 0.41}, {0.0, 0.35, -0.15}, 1.0, 0.0},
    {100, {0.046, 0.046, 0.05}, {0.0, 0.1, 0.25}, 1.0, 0.0},
    {100, {0.046, 0.046, 0.05}, {0.0, -0.1, 0.25}, 1.0, 0.0},
    {100, {0.046, 0.023, 0.05}, {-0.08, -0.605, 0.0}, 1.0, 0.0},
    {100, {0.023, 0.023, 0.02}, {0.0, -0.606, 0.0}, 1.0, 0.0},
    {100, {0.023, 0.046, 0.02}, {0.06, -0.605, 0.0}, 1.0, 0.0},
}};

bool inside(const Ellipsoid& e, glm::dvec3 p) {
  const glm::dvec3 q = p - e.centre;
  const glm::dvec3 turned(e.cosine * q.x + e.sine * q.y, e.cosine * q.y - e.sine * q.x, q.z);
  const glm::dvec3 r = turned / e.radii;
  return glm::dot(r, r) <= 1.0;
}

}  // namespace

SliceGenerator cubeGenerator(glm::ivec3 dims, uint64_t) {
  return eachVoxel<uint8_t>(dims, [](glm::ivec3) { return uint8_t(128); });
}

SliceGenerator sphereGenerator(glm::ivec3 dims, uint64_t) {
  constexpr double kRadius = 0.8;
  return eachVoxel<uint8_t>(dims, [dims](glm::ivec3 voxel) {
    const double inwards = (kRadius - glm::length(inBox(voxel, dims))) * 0.5 * std::min({dims.x, dims.y, dims.z});
    return uint8_t(255.0 * std::clamp(inwards + 0.5, 0.0, 1.0) + 0.5);
  });
}

SliceGenerator rampGenerator(glm::ivec3 dims, uint64_t) {
  return eachVoxel<float>(dims, [dims](glm::ivec3 voxel) {
    const glm::dvec3 p = betweenEnds(voxel, dims);
    return float((4.0 * p.x + 2.0 * p.y + p.z) / 7.0);
  });
}

SliceGenerator marschnerLobbGenerator(glm::ivec3 dims, uint64_t) {
  constexpr double kFrequency = 6.0;
  constexpr double kAlpha = 0.25;
  constexpr double kPi = std::numbers::pi;
  return eachVoxel<float>(dims, [dims](glm::ivec3 voxel) {
    const glm::dvec3 p = 2.0 * betweenEnds(voxel, dims) - 1.0;
    const double rings = std::cos(2.0 * kPi * kFrequency * std::cos(0.5 * kPi * std::sqrt(p.x * p.x + p.y * p.y)));
    return float((1.0 - std::sin(0.5 * kPi * p.z) + kAlpha * (1.0 + rings)) / (2.0 * (1.0 + kAlpha)));
  });
}

SliceGenerator sheppLoganGenerator(glm::ivec3 dims, uint64_t) {
  return eachVoxel<uint16_t>(dims, [dims](glm::ivec3 voxel) {
    int value = 0;
    for (const Ellipsoid& ellipsoid : kPhantom) {
      if (inside(ellipsoid, inBox(voxel, dims))) value += ellipsoid.value;
    }
    return uint16_t(std::max(value, 0));
  });
}

SliceGenerator mengerGenerator(glm::ivec3 dims, uint64_t) {
  constexpr int kMostLevels = 6;
  int cells = 3;
  for (int level = 1; level < kMostLevels && 3 * cells <= std::min({dims.x, dims.y, dims.z}); ++level)
    cells *= 3;
  return eachVoxel<uint8_t>(dims, [dims, cells](glm::ivec3 voxel) {
    glm::ivec3 cell;
    for (int axis = 0; axis < 3; ++axis) {
      cell[axis] = int((2 * int64_t(voxel[axis]) + 1) * cells / (2 * int64_t(dims[axis])));
    }
    // A hole goes through wherever two of three digits in base 3 are 1.
    for (int left = cells; left > 1; left /= 3, cell /= 3) {
      if ((cell.x % 3 == 1) + (cell.y % 3 == 1) + (cell.z % 3 == 1) >= 2) return uint8_t(0);
    }
    return uint8_t(255);
  });
}

SliceGenerator shellsGenerator(glm::ivec3 dims, uint64_t) {
  constexpr std::array kRadii{0.15, 0.3, 0.45, 0.6, 0.75, 0.9};
  constexpr double kHalfThickness = 0.025;
  return eachVoxel<uint8_t>(dims, [=](glm::ivec3 voxel) {
    const double radius = glm::length(inBox(voxel, dims));
    for (size_t shell = 0; shell < kRadii.size(); ++shell) {
      if (std::abs(radius - kRadii[shell]) <= kHalfThickness) return uint8_t(40 * (kRadii.size() - shell));
    }
    return uint8_t(0);
  });
}

}  // namespace freevoxel
