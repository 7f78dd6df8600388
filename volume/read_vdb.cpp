#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <type_traits>

#include "base/error.h"
#include "volume/component.h"
#include "volume/slice_sink.h"
#include "volume/world_space.h"

namespace freevoxel {

namespace {

/// One scalar of a grid: the grid itself, or a component of its vectors.
struct Scalar {
  std::string name;
  openvdb::GridBase::Ptr grid;
  int component = 0;
};

template <class GridType>
bool isOf(const openvdb::GridBase& grid) {
  return grid.isType<GridType>();
}

std::vector<Scalar> scalarsOf(const std::string& path, const openvdb::GridPtrVec& grids) {
  std::vector<Scalar> scalars;
  std::string others;
  for (const openvdb::GridBase::Ptr& grid : grids) {
    const std::string name = grid->getName();
    if (isOf<openvdb::FloatGrid>(*grid) || isOf<openvdb::DoubleGrid>(*grid) || isOf<openvdb::Int32Grid>(*grid) ||
        isOf<openvdb::BoolGrid>(*grid)) {
      scalars.push_back({name, grid});
    } else if (isOf<openvdb::Vec3SGrid>(*grid)) {
      for (int i = 0; i < 3; ++i)
        scalars.push_back({fmt::format("{}.{}", name, i), grid, i});
    } else {
      others += fmt::format(" '{}' ({})", name, grid->valueType());
    }
  }
  if (scalars.empty()) {
    throw InputError(fmt::format("{}: holds no grid of numbers{}", path, others.empty() ? "" : ", only" + others));
  }
  return scalars;
}

glm::dvec3 toGlm(const openvdb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}

/// Where the box of the active voxels lies.
Placement placeBox(const std::string& path, const openvdb::GridBase& grid, const openvdb::CoordBBox& box) {
  const openvdb::math::Transform& transform = grid.transform();
  if (!transform.isLinear()) {
    throw InputError(
        fmt::format("{}: grid '{}': expected a linear transform, found {}", path, grid.getName(), transform.mapType()));
  }
  const openvdb::Vec3d first = box.min().asVec3d();
  const glm::dvec3 origin = toGlm(transform.indexToWorld(first));
  glm::dmat3 edges;
  for (int axis = 0; axis < 3; ++axis) {
    openvdb::Vec3d next = first;
    next[axis] += 1.0;
    edges[axis] = toGlm(transform.indexToWorld(next)) - origin;
  }
  Placement placement =
      placeInWorld(edges, origin, FileSpace::unnamed, fmt::format("{}: grid '{}'", path, grid.getName()));
  // Differences of places far from 0 are not exact; where the library knows the size of a voxel, that is.
  const openvdb::Vec3d size = grid.voxelSize();
  for (int axis = 0; axis < 3; ++axis) {
    if (std::abs(size[axis] - placement.spacing[axis]) < 1e-9 * size[axis]) placement.spacing[axis] = size[axis];
    for (int row = 0; row < 3; ++row) {
      const double rounded = std::round(placement.direction[axis][row]);
      if (std::abs(placement.direction[axis][row] - rounded) < 1e-12) placement.direction[axis][row] = rounded + 0.0;
    }
  }
  return placement;
}

template <class T>
ValueType kept() {
  if constexpr (std::is_same_v<T, bool>) return ValueType::u8;
  if constexpr (std::is_same_v<T, int32_t>) return ValueType::i32;
  if constexpr (std::is_same_v<T, double>) return ValueType::f64;
  return ValueType::f32;
}

template <class T>
auto scalarOf(const T& value, int component) {
  if constexpr (std::is_same_v<T, openvdb::Vec3f>) {
    return value[component];
  } else if constexpr (std::is_same_v<T, bool>) {
    return uint8_t(value);
  } else {
    static_cast<void>(component);
    return value;
  }
}

template <class GridType>
void sendGrid(const std::string& path, const GridType& grid, int component, SliceSink& sink) {
  using T = typename GridType::ValueType;
  const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (box.empty()) throw InputError(fmt::format("{}: grid '{}' has no active voxels", path, grid.getName()));
  // From a corner to the opposite one may be more than an int can count.
  glm::ivec3 dims;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t size = int64_t(box.max()[axis]) - int64_t(box.min()[axis]) + 1;
    if (size > kMaxDim) {
      throw InputError(fmt::format("{}: grid '{}': its active voxels span {} along axis {}, more than {}", path,
                                   grid.getName(), size, "xyz"[axis], kMaxDim));
    }
    dims[axis] = int(size);
  }
  VolumeHeader header;
  header.dims = dims;
  header.type = kept<T>();
  header.placement = placeBox(path, grid, box);
  sink.header(header);

  // As many slices at a time as lie in one layer of leaves.
  std::vector<decltype(scalarOf(std::declval<T>(), 0))> values;
  constexpr int kLayer = 8;
  for (int z = box.min().z(); z <= box.max().z();) {
    const int last = std::min((z & ~(kLayer - 1)) + kLayer - 1, box.max().z());
    const openvdb::CoordBBox layer(box.min().x(), box.min().y(), z, box.max().x(), box.max().y(), last);
    openvdb::tools::Dense<T, openvdb::tools::LayoutXYZ> dense(layer);
    openvdb::tools::copyToDense(grid, dense, true);
    values.resize(size_t(layer.volume()));
    std::transform(dense.data(), dense.data() + values.size(), values.begin(),
                   [component](const T& value) { return scalarOf(value, component); });
    sink.values(std::as_bytes(std::span(values)));
    z = last + 1;
  }
}

}  // namespace

void readVdb(const LibraryRequest& request, SliceSink& sink) {
  const std::string& path = request.files.at(0);
  const tbb::global_control oneThread(tbb::global_control::max_allowed_parallelism, 1);
  try {
    openvdb::initialize();
    // The library itself takes no notice of a file that ends too early; a stream that throws does.
    std::ifstream file(path, std::ios::binary);
    file.exceptions(std::ios::failbit | std::ios::badbit);
    openvdb::GridPtrVecPtr grids;
    {
      openvdb::io::Stream stream(file, false);
      grids = stream.getGrids();
    }
    const std::vector<Scalar> scalars = scalarsOf(path, *grids);
    std::vector<std::string> names;
    for (const Scalar& scalar : scalars)
      names.push_back(scalar.name);
    const Scalar chosen = scalars[chooseComponent(names, request.component, path)];
    const openvdb::GridBase::Ptr& grid = chosen.grid;
    grids.reset();
    if (const auto of = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return sendGrid(path, *of, 0, sink);
    if (const auto of = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid)) return sendGrid(path, *of, 0, sink);
    if (const auto of = openvdb::gridPtrCast<openvdb::Int32Grid>(grid)) return sendGrid(path, *of, 0, sink);
    if (const auto of = openvdb::gridPtrCast<openvdb::BoolGrid>(grid)) return sendGrid(path, *of, 0, sink);
    if (const auto of = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid)) {
      return sendGrid(path, *of, chosen.component, sink);
    }
    throw InternalError("internal error: a grid of no known type was chosen");
  } catch (const std::ios::failure&) {
    throw InputError(fmt::format("{}: cut short or damaged: a grid goes on beyond the end of the file", path));
  } catch (const openvdb::Exception& error) {
    throw InputError(fmt::format("{}: damaged or cut short: {}", path, error.what()));
  }
}

}  // namespace freevoxel
