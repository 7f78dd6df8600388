#include "voxlink/shadows.h"

#include <cmath>
#include <glm/glm.hpp>

#include "base/error.h"
#include "hierarchy/direction_lookup.h"
#include "shaders/shared/directions.h"
#include "voxlink/traversal.h"

namespace freevoxel {

namespace {

uint8_t shareCode(float share) {
  return uint8_t(std::clamp(share, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// Extinction and depth of one plane of the box of stored voxels, with a border of zeros.
class Plane {
 public:
  explicit Plane(glm::ivec3 size) : width_(size.x + 2), values_(size_t(size.x + 2) * size_t(size.y + 2)) {}
  float& at(int x, int y) { return values_[size_t(y + 1) * size_t(width_) + size_t(x + 1)]; }
  float* row(int y) { return &at(0, y); }
  void clear() { std::fill(values_.begin(), values_.end(), 0.0f); }

 private:
  int width_;
  std::vector<float> values_;
};

/// Sweeps the optical depth of the voxels strictly between each stored voxel and the outside along one direction.
class DirectionSweep {
 public:
  DirectionSweep(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials, int direction)
      : buffers_(buffers),
        materials_(materials),
        step_(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction)),
        size_(buffers.grid.high - buffers.grid.low) {}

  /// Calls f(fragment index, voxel, depth) for every stored voxel.
  template <class F>
  void run(const F& f) const {
    if (step_.z == 0) {
      // Planes do not know of each other.
#pragma omp parallel for schedule(dynamic, 1)
      for (int z = 0; z < size_.z; ++z) {
        Plane extinction(size_), depth(size_);
        readPlane(z, extinction);
        for (int i = 0; i < size_.y; ++i) {
          const int y = step_.y > 0 ? size_.y - 1 - i : i;
          for (int j = 0; j < size_.x; ++j) {
            const int x = step_.x > 0 ? size_.x - 1 - j : j;
            depth.at(x, y) = depth.at(x + step_.x, y + step_.y) + extinction.at(x + step_.x, y + step_.y);
          }
        }
        tellPlane(z, depth, f);
      }
      return;
    }
    Plane extinction(size_), before(size_), depth(size_);
    for (int i = 0; i < size_.z; ++i) {
      const int z = step_.z > 0 ? size_.z - 1 - i : i;
#pragma omp parallel for schedule(static)
      for (int y = 0; y < size_.y; ++y) {
        float* out = depth.row(y);
        const float* from = before.row(y + step_.y) + step_.x;
        const float* passed = extinction.row(y + step_.y) + step_.x;
        for (int x = 0; x < size_.x; ++x)
          out[x] = from[x] + passed[x];
      }
      tellPlane(z, depth, f);
      extinction.clear();
      readPlane(z, extinction);
      std::swap(before, depth);
    }
  }

 private:
  /// Calls f(fragment index, x, y), counted from the box's corner, for every stored voxel of a plane; brick rows in
  /// parallel.
  template <class F>
  void visitPlane(int z, const F& f) const {
    const BrickGrid& grid = buffers_.grid;
    const int voxelZ = grid.low.z + z, edge = grid.edge, localZ = voxelZ % edge;
#pragma omp parallel for schedule(dynamic, 1)
    for (int by = 0; by < grid.count.y; ++by) {
      for (int bx = 0; bx < grid.count.x; ++bx) {
        const glm::ivec3 brick(grid.first.x + bx, grid.first.y + by, voxelZ / edge);
        const uint32_t* header = buffers_.header(brick);
        if (header == nullptr) continue;
        for (int column = 0; column < edge * edge; ++column) {
          if ((listMask(header, edge, column) >> localZ & 1u) == 0) continue;
          f(storedVoxel(header, edge, column * edge + localZ), brick.x * edge + column % edge - grid.low.x,
            brick.y * edge + column / edge - grid.low.y);
        }
      }
    }
  }
  void readPlane(int z, Plane& extinction) const {
    visitPlane(z, [&](size_t fragment, int x, int y) {
      extinction.at(x, y) = materials_[shared::fragmentCode(buffers_.fragments[fragment])].extinction;
    });
  }
  template <class F>
  void tellPlane(int z, Plane& depth, const F& f) const {
    visitPlane(z, [&](size_t fragment, int x, int y) {
      f(fragment, buffers_.grid.low + glm::ivec3(x, y, z), depth.at(x, y));
    });
  }

  const VoxLinkBuffers& buffers_;
  std::span<const VoxelMaterial> materials_;
  glm::ivec3 step_;
  glm::ivec3 size_;
};

/// Way of a ray per plane of voxels, in shortest voxel edges.
double lengthPerPlane(const LampView& lamp, glm::dvec3 towards) {
  const glm::dvec3 size = glm::abs(towards);
  return glm::length(lamp.lengthFromIndex * towards) / std::max({size.x, size.y, size.z});
}

/// What one direction adds to the shares of one lamp.
class DirectionShare {
 public:
  DirectionShare(const LampView& lamp, int direction) : lamp_(lamp), direction_(direction) {
    if (lamp.directional) use(lamp.index);
  }
  /// Whether any voxel needs this direction.
  bool any() const { return !lamp_.directional || weight_ > 0.0f; }
  float operator()(glm::ivec3 voxel, float depth) {
    if (!lamp_.directional) {
      const glm::dvec3 towards = lamp_.from(glm::dvec3(voxel));
      const glm::dvec3 size = glm::abs(towards);
      if (std::max({size.x, size.y, size.z}) < 0.5) return direction_ == 0 ? 1.0f : 0.0f;  // the lamp is in this voxel
      use(towards);
    }
    return weight_ > 0.0f ? weight_ * std::exp(-power_ * depth) : 0.0f;
  }

 private:
  void use(glm::dvec3 towards) {
    weight_ = 0.0f;
    const DirectionTriangle triangle = directionTriangle(towards);
    for (size_t k = 0; k < 3; ++k) {
      if (triangle.index[k] != direction_) continue;
      weight_ = directionWeights(triangle, towards)[k];
      power_ = float(lengthPerPlane(lamp_, towards));
    }
  }

  const LampView& lamp_;
  int direction_;
  float weight_ = 0.0f, power_ = 1.0f;
};

}  // namespace

LampView::LampView(const Placement& placement, const Light& light) : directional(light.directional) {
  for (int axis = 0; axis < 3; ++axis)
    lengthFromIndex[axis] = placement.direction[axis] * (placement.spacing[axis] / placement.unitLength());
  index = directional ? glm::inverse(lengthFromIndex) * light.world
                      : glm::dvec3(glm::inverse(placement.worldFromIndex()) * glm::dvec4(light.world, 1.0));
}

LightShares rayShares(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                      std::span<const Light> lights) {
  const size_t fragments = buffers.fragments.size();
  LightShares shares(fragments * lights.size());
  for (size_t n = 0; n < lights.size(); ++n) {
    const LampView lamp(buffers.placement, lights[n]);
    uint8_t* const out = shares.data() + n * fragments;
    forEachStoredVoxel(buffers, [&](size_t fragment, glm::ivec3 voxel) {
      const glm::dvec3 towards = lamp.from(glm::dvec3(voxel));
      const double length = glm::length(lamp.lengthFromIndex * towards);
      float through = 1.0f;
      if (length > 0.0) {
        const double end = lamp.directional ? INFINITY : length;
        traverse(buffers, glm::dvec3(voxel) + 0.5, towards / length, 0.0,
                 [&](size_t passed, glm::ivec3 at, double from, double to) {
                   if (from >= end) return false;
                   if (at == voxel) return true;
                   const float extinction = materials[shared::fragmentCode(buffers.fragments[passed])].extinction;
                   through *= std::exp(-extinction * float(std::min(to, end) - from));
                   return through >= shared::kOpaqueEnough;
                 });
      }
      out[fragment] = shareCode(through);
    });
  }
  return shares;
}

LightShares attenuationShares(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                              std::span<const Light> lights) {
  const size_t fragments = buffers.fragments.size();
  std::vector<LampView> lamps;
  for (const Light& light : lights)
    lamps.emplace_back(buffers.placement, light);
  std::vector<float> sums(fragments * lights.size());
  for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
    std::vector<std::pair<size_t, DirectionShare>> taking;
    for (size_t n = 0; n < lamps.size(); ++n) {
      const DirectionShare share(lamps[n], direction);
      if (share.any()) taking.emplace_back(n, share);
    }
    if (taking.empty()) continue;
    DirectionSweep(buffers, materials, direction).run([&](size_t fragment, glm::ivec3 voxel, float depth) {
      for (const auto& [n, share] : taking) {
        DirectionShare own = share;
        sums[n * fragments + fragment] += own(voxel, depth);
      }
    });
  }
  LightShares shares(sums.size());
  for (size_t i = 0; i < sums.size(); ++i)
    shares[i] = shareCode(sums[i]);
  return shares;
}

LightShares lightShares(const VoxLinkBuffers& buffers, std::span<const VoxelMaterial> materials,
                        std::span<const Light> lights, Shadows shadows) {
  switch (shadows) {
    case Shadows::attenuation:
      return attenuationShares(buffers, materials, lights);
    case Shadows::rays:
      return rayShares(buffers, materials, lights);
    case Shadows::none:
      break;
  }
  return LightShares(buffers.fragments.size() * lights.size(), uint8_t(255));
}

}  // namespace freevoxel
