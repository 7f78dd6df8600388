#include "splat/raycast.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <vector>

#include "base/error.h"
#include "splat/light_grid.h"
#include "splat/volume_view.h"

namespace freevoxel {

namespace {

/// Light below this share of what entered cannot change a picture's float.
constexpr float kOpaque = 1e-7f;
/// The same of a way's optical depth.
constexpr double kOpaqueDepth = 16.2;
/// A sample that adds less than this share of a ray's light takes the light of the last one that added more: no picture
/// shows the difference, and shadow rays are all that costs time.
constexpr float kFaint = 1e-4f;
/// Voxels an edge of the cubes that are skipped where nothing in them is visible.
constexpr int kSkipEdge = 8;
/// Entries of the table of post-classification per step of the value's code.
constexpr size_t kTableStepsPerCode = 32;
constexpr size_t kLargestTable = size_t(1) << 21;

/// Colour times extinction, and extinction, per shortest voxel edge.
struct Medium {
  glm::vec3 emission{0.0f};
  float extinction = 0.0f;
};

Medium medium(const Classified& c) {
  return {c.linear * c.extinction, c.extinction};
}

Medium mix(const Medium& a, const Medium& b, float t) {
  return {a.emission + t * (b.emission - a.emission), a.extinction + t * (b.extinction - a.extinction)};
}

class Caster {
 public:
  Caster(const ValueGrid& grid, const TransferFunction& transfer, const RaycastOptions& options)
      : grid_(grid),
        options_(options),
        worldFromIndex_(grid.placement.worldFromIndex()),
        gradientFromIndex_(gradientFromDifferences(grid)) {
    for (const Light& light : options.lighting.lights) {
      targets_.push_back(light.directional ? Towards::direction(grid.placement, light.world)
                                           : Towards::point(grid.placement, light.world));
    }
    const size_t codes = size_t(grid.coding.largest) + 1;
    ofCode_.resize(codes);
    for (size_t code = 0; code < codes; ++code)
      ofCode_[code] = medium(transfer.at(grid.coding.decode(double(code))));
    const size_t steps = std::min(kTableStepsPerCode * size_t(grid.coding.largest), kLargestTable);
    tablePerCode_ = double(steps) / grid.coding.largest;
    table_.resize(steps + 1);
    for (size_t i = 0; i <= steps; ++i)
      table_[i] = medium(transfer.at(grid.coding.decode(double(i) / tablePerCode_)));
    findVisibleCubes(transfer);
  }

  /// What a ray gathers, with positions in index space; `step` in shortest voxel edges.
  glm::vec4 trace(glm::dvec3 origin, glm::dvec3 direction) const {
    const auto [enter, leave] = clip(origin, direction);
    if (!(enter < leave)) return glm::vec4(0.0f);
    // Equal steps that fill the ray's way through the box exactly, none longer than asked for.
    const double wanted = std::ceil((leave - enter) / options_.step);
    const int64_t steps = int64_t(std::max(1.0, wanted));
    const double length = (leave - enter) / double(steps);
    const bool lit = !options_.lighting.unlit();
    const glm::vec3 towardsEye = glm::normalize(glm::vec3(worldFromIndex_ * glm::dvec4(-direction, 0.0)));
    glm::vec3 light(0.0f), arriving(1.0f);
    bool arrivingKnown = !lit;
    float through = 1.0f;
    for (int64_t i = 0; i < steps;) {
      const double t = enter + (double(i) + 0.5) * length;
      const glm::dvec3 p = origin + t * direction;
      const int64_t skip = stepsToSkip(p, direction, length);
      if (skip > 0) {
        i += skip;
        continue;
      }
      const Medium m = sample(p);
      if (m.extinction > 0.0f) {
        const float passed = std::exp(-m.extinction * float(length));
        const float emitted = through * (1.0f - passed);
        if (lit && (!arrivingKnown || emitted > kFaint)) {
          arriving = lightAt(p, towardsEye);
          arrivingKnown = true;
        }
        light += emitted / m.extinction * m.emission * arriving;
        through *= passed;
        if (through < kOpaque) break;
      }
      ++i;
    }
    return glm::vec4(light, 1.0f - through);
  }

  /// Share of light that gets from p to a target.
  float transmittance(glm::dvec3 p, const Towards& target, double step) const {
    const glm::dvec3 u = target.from(p);
    const double distance = glm::length(target.lengthFromIndex * u);
    if (!(distance > 0.0)) return 1.0f;
    const glm::dvec3 direction = u / distance;
    const double leave = std::min(clip(p, direction).second, target.directional ? double(INFINITY) : distance);
    if (!(leave > 0.0)) return 1.0f;
    const int64_t steps = std::max(int64_t(1), int64_t(std::ceil(leave / step)));
    const double length = leave / double(steps);
    double depth = 0.0;
    for (int64_t i = 0; i < steps;) {
      const glm::dvec3 at = p + (double(i) + 0.5) * length * direction;
      const int64_t skip = stepsToSkip(at, direction, length);
      if (skip > 0) {
        i += skip;
        continue;
      }
      depth += double(sample(at).extinction) * length;
      if (depth > kOpaqueDepth) return 0.0f;
      ++i;
    }
    return float(std::exp(-depth));
  }

 private:
  /// Where a ray enters and leaves the box, from its origin on.
  std::pair<double, double> clip(glm::dvec3 origin, glm::dvec3 direction) const {
    double enter = 0.0, leave = INFINITY;
    const double beyond = options_.classification == RaycastClassification::pre ? 1.0 : 0.5;
    for (int axis = 0; axis < 3; ++axis) {
      const double lower = -beyond - origin[axis];
      const double upper = grid_.dims[axis] - 1 + beyond - origin[axis];
      if (direction[axis] == 0.0) {
        if (lower > 0.0 || upper < 0.0) return {0.0, 0.0};
        continue;
      }
      const double t0 = lower / direction[axis], t1 = upper / direction[axis];
      enter = std::max(enter, std::min(t0, t1));
      leave = std::min(leave, std::max(t0, t1));
    }
    return {enter, leave};
  }

  /// Light that arrives at p and leaves for the eye.
  glm::vec3 lightAt(glm::dvec3 p, glm::vec3 towardsEye) const {
    const Lighting& lighting = options_.lighting;
    Surface surface;
    if (lighting.shading != Shading::none && options_.classification != RaycastClassification::nearest)
      surface = surfaceFacing(gradientFromIndex_ * gradientAt(p), towardsEye);
    glm::vec3 sum(lighting.ambient);
    for (size_t lamp = 0; lamp < targets_.size(); ++lamp) {
      const glm::dvec3 toLight = targets_[lamp].lengthFromIndex * targets_[lamp].from(p);
      const double distance = glm::length(toLight);
      const float share =
          distance > 0.0 ? shade(lighting.shading, surface, glm::vec3(toLight / distance), towardsEye) : 1.0f;
      if (share > 0.0f)
        sum += lighting.lights[lamp].linear * (share * transmittance(p, targets_[lamp], options_.shadowStep));
    }
    return sum;
  }

  /// Index gradient between voxels, interpolated.
  glm::vec3 gradientAt(glm::dvec3 p) const {
    const glm::dvec3 inside = glm::clamp(p, glm::dvec3(0.0), glm::dvec3(grid_.dims - 1));
    const glm::ivec3 low(inside), high = glm::min(low + 1, grid_.dims - 1);
    const glm::vec3 t(inside - glm::dvec3(low));
    glm::vec3 sum(0.0f);
    for (int corner = 0; corner < 8; ++corner) {
      const glm::bvec3 up(corner & 1, corner & 2, corner & 4);
      const float weight = (up.x ? t.x : 1.0f - t.x) * (up.y ? t.y : 1.0f - t.y) * (up.z ? t.z : 1.0f - t.z);
      if (weight > 0.0f) sum += weight * indexGradient(grid_, glm::mix(low, high, up));
    }
    return sum;
  }

  void findVisibleCubes(const TransferFunction& transfer) {
    // visibleUpTo[c]: how many of the unit intervals of codes below c hold something visible.
    const ValueCoding& coding = grid_.coding;
    std::vector<uint32_t> visibleUpTo(size_t(coding.largest) + 2, 0);
    for (uint32_t c = 0; c <= coding.largest; ++c) {
      const double from = coding.decode(c), to = coding.decode(std::min(c + 1, coding.largest));
      visibleUpTo[c + 1] = visibleUpTo[c] + (transfer.largestOpacity(from, to) > 0.0 ? 1 : 0);
    }
    cubes_ = (grid_.dims + (kSkipEdge - 1)) / kSkipEdge;
    visible_.assign(voxelCount(cubes_), 0);
#pragma omp parallel for schedule(dynamic, 1)
    for (int cz = 0; cz < cubes_.z; ++cz) {
      for (int cy = 0; cy < cubes_.y; ++cy) {
        for (int cx = 0; cx < cubes_.x; ++cx) {
          uint32_t low = UINT32_MAX, high = 0;
          const glm::ivec3 first = glm::max(glm::ivec3(cx, cy, cz) * kSkipEdge - 1, glm::ivec3(0));
          const glm::ivec3 last = glm::min((glm::ivec3(cx, cy, cz) + 1) * kSkipEdge, grid_.dims - 1);
          for (int z = first.z; z <= last.z; ++z) {
            for (int y = first.y; y <= last.y; ++y) {
              for (int x = first.x; x <= last.x; ++x) {
                const uint32_t code = grid_.codes[linearIndex({x, y, z}, grid_.dims)];
                low = std::min(low, code);
                high = std::max(high, code);
              }
            }
          }
          // The interval above `high` counts only for its lower end, but being generous costs nothing.
          const bool visible = low <= high && visibleUpTo[high + 1] > visibleUpTo[low];
          visible_[linearIndex({cx, cy, cz}, cubes_)] = visible ? 1 : 0;
        }
      }
    }
  }

  /// How many samples from p on surely lie in an invisible cube; 0 if p's cube is visible.
  int64_t stepsToSkip(glm::dvec3 p, glm::dvec3 direction, double length) const {
    glm::ivec3 cube;
    for (int axis = 0; axis < 3; ++axis) {
      cube[axis] = std::clamp(int(std::floor(p[axis])) >> 3, 0, cubes_[axis] - 1);
    }
    static_assert(kSkipEdge == 8);
    if (visible_[linearIndex(cube, cubes_)] != 0) return 0;
    double exit = INFINITY;
    for (int axis = 0; axis < 3; ++axis) {
      if (direction[axis] > 0.0 && cube[axis] < cubes_[axis] - 1) {
        exit = std::min(exit, ((cube[axis] + 1) * kSkipEdge - p[axis]) / direction[axis]);
      } else if (direction[axis] < 0.0 && cube[axis] > 0) {
        exit = std::min(exit, (cube[axis] * kSkipEdge - p[axis]) / direction[axis]);
      }
    }
    if (!(exit < 1e18)) return INT32_MAX;
    return std::max(int64_t(1), int64_t(std::ceil(exit / length)));
  }

  Medium sample(glm::dvec3 p) const {
    if (options_.classification == RaycastClassification::nearest) {
      glm::ivec3 v;
      for (int axis = 0; axis < 3; ++axis)
        v[axis] = std::clamp(int(std::floor(p[axis] + 0.5)), 0, grid_.dims[axis] - 1);
      return ofCode_[grid_.codes[linearIndex(v, grid_.dims)]];
    }
    if (options_.classification == RaycastClassification::pre) return samplePre(p);
    glm::ivec3 v0, v1;
    glm::vec3 t;
    for (int axis = 0; axis < 3; ++axis) {
      const double clamped = std::clamp(p[axis], 0.0, double(grid_.dims[axis] - 1));
      v0[axis] = std::min(int(clamped), std::max(grid_.dims[axis] - 2, 0));
      v1[axis] = std::min(v0[axis] + 1, grid_.dims[axis] - 1);
      t[axis] = float(clamped - v0[axis]);
    }
    float values[8];
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 v((corner & 1) ? v1.x : v0.x, (corner & 2) ? v1.y : v0.y, (corner & 4) ? v1.z : v0.z);
      values[corner] = float(grid_.codes[linearIndex(v, grid_.dims)]);
    }
    for (int axis = 0, count = 4; axis < 3; ++axis, count /= 2) {
      for (int i = 0; i < count; ++i)
        values[i] = values[2 * i] + t[axis] * (values[2 * i + 1] - values[2 * i]);
    }
    const double place = std::clamp(double(values[0]), 0.0, double(grid_.coding.largest)) * tablePerCode_;
    const size_t entry = std::min(size_t(place), table_.size() - 2);
    return mix(table_[entry], table_[entry + 1], float(place - double(entry)));
  }

  /// Beyond the outermost voxels there is nothing: they fade out over one voxel, as splats do.
  Medium samplePre(glm::dvec3 p) const {
    const glm::ivec3 low(glm::floor(p));
    Medium corners[8];
    for (int corner = 0; corner < 8; ++corner) {
      const glm::ivec3 v = low + glm::ivec3(corner & 1, corner >> 1 & 1, corner >> 2);
      if (glm::clamp(v, glm::ivec3(0), grid_.dims - 1) == v)
        corners[corner] = ofCode_[grid_.codes[linearIndex(v, grid_.dims)]];
    }
    for (int axis = 0, count = 4; axis < 3; ++axis, count /= 2) {
      const float t = float(p[axis] - low[axis]);
      for (int i = 0; i < count; ++i)
        corners[i] = mix(corners[2 * i], corners[2 * i + 1], t);
    }
    return corners[0];
  }

  const ValueGrid& grid_;
  RaycastOptions options_;
  glm::dmat4 worldFromIndex_;
  glm::mat3 gradientFromIndex_;
  std::vector<Towards> targets_;  ///< the lamps
  std::vector<Medium> ofCode_;
  std::vector<Medium> table_;  ///< over the range of codes, linear in between
  double tablePerCode_ = 1.0;
  glm::ivec3 cubes_{0};
  std::vector<uint8_t> visible_;
};

}  // namespace

Image raycast(const ValueGrid& grid, const TransferFunction& transfer, const Camera& camera,
              const RaycastOptions& options, Progress& progress) {
  if (!(options.step > 0.0) || !std::isfinite(options.step)) {
    throw InputError(fmt::format("raycast: step {} is not a positive length", options.step));
  }
  if (!(options.shadowStep > 0.0) || !std::isfinite(options.shadowStep)) {
    throw InputError(fmt::format("raycast: shadow step {} is not a positive length", options.shadowStep));
  }
  checkLighting(options.lighting);
  checkEqual(uint64_t(grid.codes.size()), voxelCount(grid.dims), "codes of the grid");
  const ViewFrame frame = viewFrame(camera);
  const Caster caster(grid, transfer, options);
  const glm::dmat4 indexFromWorld = glm::inverse(grid.placement.worldFromIndex());
  const double unit = grid.placement.unitLength();
  Image picture(camera.imageSize, 4);
  progress.begin("ray casting", uint64_t(camera.imageSize.y), "rows");
#pragma omp parallel for schedule(dynamic, 4)
  for (int y = 0; y < camera.imageSize.y; ++y) {
    for (int x = 0; x < camera.imageSize.x; ++x) {
      const Ray ray = pixelRay(frame, glm::dvec2(x, y) + 0.5);
      // A world direction of one shortest voxel edge: the ray's parameter then counts these.
      const glm::dvec3 origin(indexFromWorld * glm::dvec4(ray.origin, 1.0));
      const glm::dvec3 direction(indexFromWorld * glm::dvec4(ray.direction * unit, 0.0));
      const glm::vec4 pixel = caster.trace(origin, direction);
      std::copy_n(&pixel[0], 4, picture.at(x, y));
    }
#pragma omp critical(freevoxelRaycastProgress)
    progress.advance(1);
  }
  progress.end();
  return picture;
}

std::vector<float> marchTransmittance(const ValueGrid& grid, const TransferFunction& transfer,
                                      std::span<const glm::dvec3> positions, const Towards& target, double step) {
  if (!(step > 0.0) || !std::isfinite(step)) {
    throw InputError(fmt::format("raycast: step {} is not a positive length", step));
  }
  const Caster caster(grid, transfer, {});
  std::vector<float> result(positions.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (int64_t i = 0; i < int64_t(positions.size()); ++i)
    result[size_t(i)] = caster.transmittance(positions[size_t(i)], target, step);
  return result;
}

}  // namespace freevoxel
