#include "voxlink/scene_voxels.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>

#include "base/error.h"
#include "voxlink/buffers.h"

namespace freevoxel {

namespace {

bool isFinite(glm::dvec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

void checkScene(const TracedScene& scene) {
  const auto fail = [](const std::string& what) { throw InputError("scene: " + what); };
  const Mesh& mesh = scene.mesh;
  const Spheres& spheres = scene.spheres;
  if (mesh.materialOfTriangle.size() != mesh.triangles.size()) fail("not every triangle has a material");
  if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size()) fail("not every vertex has a normal");
  if (mesh.triangles.size() > UINT32_MAX) fail("more triangles than 32 bits can name");
  for (const glm::uvec3& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) {
      if (triangle[i] >= mesh.positions.size()) {
        fail(fmt::format("vertex {} of {} in a triangle", triangle[i], mesh.positions.size()));
      }
      if (!isFinite(glm::dvec3(mesh.positions[triangle[i]]))) fail("a vertex that is no number");
    }
  }
  for (const uint32_t material : mesh.materialOfTriangle) {
    if (material >= mesh.materials.size()) fail(fmt::format("material {} of {}", material, mesh.materials.size()));
  }
  if (spheres.radii.size() != spheres.centres.size() || spheres.materialOfSphere.size() != spheres.centres.size()) {
    fail("not every sphere has a radius and a material");
  }
  if (spheres.centres.size() >= shared::kMostSceneSpheres) fail("more spheres than 30 bits can name");
  for (size_t i = 0; i < spheres.centres.size(); ++i) {
    if (!isFinite(glm::dvec3(spheres.centres[i])) || !std::isfinite(spheres.radii[i]) || !(spheres.radii[i] > 0.0f)) {
      fail(fmt::format("sphere {} has no place or no size", i));
    }
    if (spheres.materialOfSphere[i] >= spheres.materials.size()) {
      fail(fmt::format("material {} of {}", spheres.materialOfSphere[i], spheres.materials.size()));
    }
  }
  if (mesh.materials.size() + spheres.materials.size() > shared::kMostSceneMaterials) {
    fail(fmt::format("{} materials, at most {} can be named", mesh.materials.size() + spheres.materials.size(),
                     shared::kMostSceneMaterials));
  }
  if (scene.volumes.size() >= shared::kMostSceneMaterials) fail("too many volumes");
}

SurfaceMaterial surfaceMaterial(const Material& material) {
  const glm::vec3& c = material.linear;
  const auto share = [](float x) { return x >= 0.0f && x <= 1.0f; };
  if (!share(c.r) || !share(c.g) || !share(c.b) || !share(material.opacity) || !share(material.reflectance) ||
      !(material.indexOfRefraction >= 1.0f && material.indexOfRefraction <= 4.0f)) {
    throw InputError(fmt::format(
        "material \"{}\": expected colours, opacity and reflectance from 0 to 1 and an index of refraction from 1 to 4",
        material.name));
  }
  const uint32_t kind = material.kind == MaterialKind::mirror  ? shared::kMirror
                        : material.kind == MaterialKind::glass ? shared::kGlass
                                                               : shared::kDiffuse;
  return {c.r, c.g, c.b, material.opacity, material.reflectance, material.indexOfRefraction, kind, 0};
}

/// Value at a place in index space as a code: trilinear, of the outermost voxels beyond them; of the nearest for
/// labels.
uint32_t codeAt(const ValueGrid& grid, bool labels, glm::dvec3 place) {
  glm::ivec3 low, high;
  glm::dvec3 weight;
  for (int axis = 0; axis < 3; ++axis) {
    const double p = std::clamp(place[axis], 0.0, double(grid.dims[axis] - 1));
    low[axis] = labels ? int(std::lround(p)) : int(p);
    high[axis] = labels ? low[axis] : std::min(low[axis] + 1, grid.dims[axis] - 1);
    weight[axis] = labels ? 0.0 : p - low[axis];
  }
  const auto code = [&](int x, int y, int z) { return double(grid.codes[linearIndex({x, y, z}, grid.dims)]); };
  if (labels) return grid.codes[linearIndex(low, grid.dims)];
  const auto row = [&](int y, int z) {
    return code(low.x, y, z) + weight.x * (code(high.x, y, z) - code(low.x, y, z));
  };
  const auto plane = [&](int z) { return row(low.y, z) + weight.y * (row(high.y, z) - row(low.y, z)); };
  return uint32_t(plane(low.z) + weight.z * (plane(high.z) - plane(low.z)) + 0.5);
}

void sampleVolume(const SceneVolume& volume, uint16_t index, double threshold, SceneVoxels& voxels) {
  const ValueGrid& grid = volume.grid;
  const SceneGrid& space = voxels.grid;
  const bool labels = volume.transfer.isLabels;
  const std::vector<uint8_t> stored = storedCodes(volume.transfer, grid.coding, threshold);
  const double lengths = space.edge / grid.placement.unitLength();  // a voxel here in shortest edges there
  voxels.firstOfVolume.push_back(uint32_t(voxels.volumeMaterials.size()));
  for (VoxelMaterial material : voxelMaterials(volume.transfer, grid.coding, stored)) {
    material.extinction = float(material.extinction * lengths);
    voxels.volumeMaterials.push_back(material);
  }
  const glm::dmat4 indexFromWorld = glm::inverse(grid.placement.worldFromIndex());
  const glm::mat3 gradientMatrix(gradientFromDifferences(grid));
  const Box box = worldBounds(grid.placement, grid.dims);
  const glm::ivec3 first = glm::max(glm::ivec3(glm::floor(space.voxelsFromWorld(box.lower))), 0);
  const glm::ivec3 last = glm::min(glm::ivec3(glm::floor(space.voxelsFromWorld(box.upper))), space.dims - 1);
  std::vector<std::vector<VolumeSample>> slices(size_t(std::max(0, last.z - first.z + 1)));
#pragma omp parallel for schedule(dynamic, 1)
  for (int z = first.z; z <= last.z; ++z) {
    for (int y = first.y; y <= last.y; ++y) {
      for (int x = first.x; x <= last.x; ++x) {
        const glm::dvec3 world = glm::dvec3(space.origin) + (glm::dvec3(x, y, z) + 0.5) * space.edge;
        const glm::dvec3 place(indexFromWorld * glm::dvec4(world, 1.0));
        bool outside = false;
        for (int axis = 0; axis < 3; ++axis)
          outside = outside || !(place[axis] >= -0.5 && place[axis] <= grid.dims[axis] - 0.5);
        if (outside) continue;
        const uint32_t code = codeAt(grid, labels, place);
        if (stored[code] == 0) continue;
        const glm::ivec3 nearest = glm::clamp(glm::ivec3(glm::floor(place + 0.5)), glm::ivec3(0), grid.dims - 1);
        slices[size_t(z - first.z)].push_back({{uint16_t(x), uint16_t(y), uint16_t(z)},
                                               index,
                                               shared::fragmentOf(code, voxelNormal(grid, gradientMatrix, nearest))});
      }
    }
  }
  for (const std::vector<VolumeSample>& slice : slices)
    voxels.samples.insert(voxels.samples.end(), slice.begin(), slice.end());
}

}  // namespace

Box sceneBounds(const TracedScene& scene) {
  checkScene(scene);
  const double far = std::numeric_limits<double>::infinity();
  Box box{glm::dvec3(far), glm::dvec3(-far)};
  const auto add = [&](glm::dvec3 lower, glm::dvec3 upper) {
    box.lower = glm::min(box.lower, lower);
    box.upper = glm::max(box.upper, upper);
  };
  for (const glm::uvec3& triangle : scene.mesh.triangles) {
    for (int i = 0; i < 3; ++i)
      add(glm::dvec3(scene.mesh.positions[triangle[i]]), glm::dvec3(scene.mesh.positions[triangle[i]]));
  }
  for (size_t i = 0; i < scene.spheres.centres.size(); ++i) {
    const glm::dvec3 centre(scene.spheres.centres[i]);
    add(centre - double(scene.spheres.radii[i]), centre + double(scene.spheres.radii[i]));
  }
  for (const SceneVolume& volume : scene.volumes) {
    const Box own = worldBounds(volume.grid.placement, volume.grid.dims);
    add(own.lower, own.upper);
  }
  if (!(box.lower.x <= box.upper.x)) {
    throw InputError("scene: expected a mesh with triangles, spheres or a volume, found none");
  }
  return box;
}

SceneGrid sceneGrid(const Box& box, int resolution) {
  if (resolution < 1 || resolution > SceneVoxLinkOptions::kMostResolution) {
    throw InputError(fmt::format("VoxLink: expected a resolution of 1 to {}, found {}",
                                 SceneVoxLinkOptions::kMostResolution, resolution));
  }
  const glm::dvec3 extent = box.extent();
  const double longest = std::max({extent.x, extent.y, extent.z});
  if (!std::isfinite(longest) || !isFinite(glm::dvec3(glm::vec3(box.lower)))) {
    throw InputError("scene: it is larger than numbers can tell");
  }
  SceneGrid grid;
  // The lower corner as a float, and not above the box.
  for (int axis = 0; axis < 3; ++axis) {
    grid.origin[axis] = float(box.lower[axis]);
    if (double(grid.origin[axis]) > box.lower[axis]) {
      grid.origin[axis] = std::nextafter(grid.origin[axis], -std::numeric_limits<float>::infinity());
    }
  }
  grid.edge = longest > 0.0 ? longest / resolution : 1.0;
  for (int axis = 0; axis < 3; ++axis)
    grid.dims[axis] = std::clamp(int(std::ceil(extent[axis] / grid.edge - 1e-9)), 1, resolution);
  // Coordinates are floats: where they have no digits left for a voxel there is nothing to see.
  const double size = std::max({std::abs(box.lower.x), std::abs(box.lower.y), std::abs(box.lower.z),
                                std::abs(box.upper.x), std::abs(box.upper.y), std::abs(box.upper.z)});
  if (size * 0x1p-23 > grid.edge) {
    throw InputError(fmt::format(
        "scene: {} voxels over a length of {} so far from 0 ({}) are finer than its coordinates; lower --resolution",
        resolution, longest, size));
  }
  return grid;
}

SceneVoxels sceneVoxels(const TracedScene& scene, const SceneGrid& grid, double threshold) {
  checkScene(scene);
  SceneVoxels voxels;
  voxels.grid = grid;
  voxels.mesh = &scene.mesh;
  for (const Material& material : scene.mesh.materials)
    voxels.materials.push_back(surfaceMaterial(material));
  for (const Material& material : scene.spheres.materials)
    voxels.materials.push_back(surfaceMaterial(material));
  const uint32_t firstOfSpheres = uint32_t(scene.mesh.materials.size());
  voxels.spheres.reserve(scene.spheres.centres.size());
  for (size_t i = 0; i < scene.spheres.centres.size(); ++i) {
    const glm::vec3 centre(grid.voxelsFromWorld(glm::dvec3(scene.spheres.centres[i])));
    voxels.spheres.push_back({centre.x, centre.y, centre.z, float(double(scene.spheres.radii[i]) / grid.edge),
                              firstOfSpheres + scene.spheres.materialOfSphere[i]});
  }
  for (size_t i = 0; i < scene.volumes.size(); ++i)
    sampleVolume(scene.volumes[i], uint16_t(i), threshold, voxels);
  return voxels;
}

SnappedSphere snappedSphere(const SceneSphere& sphere) {
  const float scale = float(shared::kSubvoxels);
  return {{shared::snapped(sphere.x, 0.0f, scale), shared::snapped(sphere.y, 0.0f, scale),
           shared::snapped(sphere.z, 0.0f, scale)},
          shared::snapped(sphere.radius, 0.0f, scale)};
}

VoxelRange rangeOf(const SnappedSphere& sphere, glm::ivec3 dims) {
  VoxelRange range;
  for (int axis = 0; axis < 3; ++axis) {
    range.first[axis] = std::max(0, sphere.centre[axis] - sphere.radius - 3) / shared::kSubvoxels;
    range.last[axis] =
        std::min((std::max(0, sphere.centre[axis] + sphere.radius + 3)) / shared::kSubvoxels, dims[axis] - 1);
  }
  return range;
}

bool touches(const SnappedSphere& sphere, glm::ivec3 voxel) {
  int64_t nearest = 0, farthest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t low = int64_t(voxel[axis]) * shared::kSubvoxels - sphere.centre[axis];
    const int64_t high = low + shared::kSubvoxels;
    const int64_t near = low > 0 ? low : high < 0 ? high : 0;
    const int64_t far = std::max(std::abs(low), std::abs(high));
    nearest += near * near;
    farthest += far * far;
  }
  const int64_t outer = sphere.radius + 2, inner = std::max(0, sphere.radius - 2);
  return nearest <= outer * outer && farthest >= inner * inner;
}

}  // namespace freevoxel
