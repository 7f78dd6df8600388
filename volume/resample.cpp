#include "volume/resample.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <type_traits>

#include "base/error.h"

namespace freevoxel {

namespace {

/// Where a new voxel's centre lies among old ones along one axis.
struct AxisPlace {
  int low, high;
  double t;
};

std::vector<AxisPlace> axisPlaces(int from, int to, bool nearest) {
  std::vector<AxisPlace> places(static_cast<size_t>(to));
  for (int i = 0; i < to; ++i) {
    const double at = std::clamp((i + 0.5) * from / to - 0.5, 0.0, double(from - 1));
    const int low = nearest ? int(at + 0.5) : int(at);
    places[size_t(i)] = {low, std::min(low + 1, from - 1), nearest ? 0.0 : at - low};
  }
  return places;
}

template <class T>
T valueOf(double x) {
  if constexpr (std::is_integral_v<T>) {
    return T(std::clamp(std::round(x), double(std::numeric_limits<T>::min()), double(std::numeric_limits<T>::max())));
  } else {
    return T(x);
  }
}

}  // namespace

glm::ivec3 resampledDims(const VolumeHeader& header, int longest) {
  const glm::dvec3 extent = glm::dvec3(header.dims) * header.placement.spacing;
  const double most = std::max({extent.x, extent.y, extent.z});
  glm::ivec3 dims;
  for (int axis = 0; axis < 3; ++axis)
    dims[axis] = std::max(1, int(std::lround(extent[axis] / most * longest)));
  return dims;
}

Volume resampled(const Volume& volume, glm::ivec3 dims) {
  if (!validDims(dims)) {
    throw InputError(fmt::format("resampling to {} x {} x {} voxels: expected 1 to {} along each axis", dims.x, dims.y,
                                 dims.z, kMaxDim));
  }
  Volume result;
  result.header = volume.header;
  result.header.dims = dims;
  Placement& placement = result.header.placement;
  for (int axis = 0; axis < 3; ++axis) {
    const double spacing = volume.header.placement.spacing[axis];
    placement.spacing[axis] = spacing * volume.header.dims[axis] / dims[axis];
    placement.origin += placement.direction[axis] * (0.5 * (placement.spacing[axis] - spacing));
  }
  const uint64_t machine = uint64_t(sysconf(_SC_PHYS_PAGES)) * uint64_t(sysconf(_SC_PAGESIZE));
  const auto bytes = checkedProduct(voxelCount(dims), bytesPerValue(volume.header.type));
  // Whoever wants values wants their codes too.
  if (!bytes || *bytes > machine || *bytes + voxelCount(dims) * sizeof(uint16_t) > machine) {
    throw MachineError(
        fmt::format("resampling to {} x {} x {} voxels takes more memory than the {} MiB of this "
                    "machine; choose a lower resolution",
                    dims.x, dims.y, dims.z, machine >> 20));
  }
  result.data.resize(size_t(*bytes));
  const bool nearest = volume.header.labels;
  const std::vector<AxisPlace> xs = axisPlaces(volume.header.dims.x, dims.x, nearest);
  const std::vector<AxisPlace> ys = axisPlaces(volume.header.dims.y, dims.y, nearest);
  const std::vector<AxisPlace> zs = axisPlaces(volume.header.dims.z, dims.z, nearest);
  withValues(volume, [&](const auto* values) {
    using T = std::remove_cvref_t<decltype(*values)>;
    T* const out = reinterpret_cast<T*>(result.data.data());
#pragma omp parallel for schedule(dynamic, 1)
    for (int z = 0; z < dims.z; ++z) {
      for (int y = 0; y < dims.y; ++y) {
        const AxisPlace& pz = zs[size_t(z)];
        const AxisPlace& py = ys[size_t(y)];
        const glm::ivec3 from = volume.header.dims;
        const T* rows[4] = {
            values + linearIndex({0, py.low, pz.low}, from), values + linearIndex({0, py.high, pz.low}, from),
            values + linearIndex({0, py.low, pz.high}, from), values + linearIndex({0, py.high, pz.high}, from)};
        T* const row = out + linearIndex({0, y, z}, dims);
        for (int x = 0; x < dims.x; ++x) {
          const AxisPlace& px = xs[size_t(x)];
          const auto along = [&](const T* source) {
            return px.t == 0.0 ? double(source[px.low])
                               : double(source[px.low]) + px.t * (double(source[px.high]) - double(source[px.low]));
          };
          const auto across = [](double a, double b, double t) { return t == 0.0 ? a : a + t * (b - a); };
          const double low = across(along(rows[0]), py.t == 0.0 ? 0.0 : along(rows[1]), py.t);
          const double high = pz.t == 0.0 ? 0.0 : across(along(rows[2]), py.t == 0.0 ? 0.0 : along(rows[3]), py.t);
          row[x] = valueOf<T>(across(low, high, pz.t));
        }
      }
    }
  });
  return result;
}

}  // namespace freevoxel
