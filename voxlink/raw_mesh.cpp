#include "voxlink/raw_mesh.h"

#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <unordered_map>

#include "base/error.h"

namespace freevoxel {

namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

bool isFinite(glm::vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

struct PositionHash {
  size_t operator()(glm::vec3 p) const {
    uint64_t hash = 0;
    for (int axis = 0; axis < 3; ++axis)
      hash = (hash ^ std::bit_cast<uint32_t>(p[axis])) * 0x9e3779b97f4a7c15u;
    return size_t(hash ^ (hash >> 32));
  }
};

void checkIndices(const Mesh& mesh, const std::string& path) {
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      if (mesh.triangles[i][corner] < mesh.positions.size()) continue;
      throw InputError(fmt::format("{}: triangle {}: expected vertices from 0 to below {}, found {}", path, i,
                                   mesh.positions.size(), mesh.triangles[i][corner]));
    }
    check(mesh.materialOfTriangle[i] < mesh.materials.size(), "materials of triangles are there");
  }
}

/// Number of each vertex among those that stay; kNone for those that do not.
std::vector<uint32_t> numberVertices(Mesh& mesh, bool join, MeshReport& report) {
  std::vector<uint32_t> numbers(mesh.positions.size(), kNone);
  std::unordered_map<glm::vec3, uint32_t, PositionHash> places;
  uint32_t kept = 0;
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const glm::vec3 position = mesh.positions[i] + 0.0f;  // one kind of zero
    if (!isFinite(position)) {
      ++report.nonFiniteVertices;
      continue;
    }
    if (join) {
      const auto [place, isNew] = places.try_emplace(position, kept);
      numbers[i] = place->second;
      if (!isNew) continue;
    } else {
      numbers[i] = kept;
    }
    mesh.positions[kept] = position;
    if (!mesh.normals.empty()) mesh.normals[kept] = mesh.normals[i];
    ++kept;
  }
  mesh.positions.resize(kept);
  if (!mesh.normals.empty()) mesh.normals.resize(kept);
  return numbers;
}

bool hasArea(const Mesh& mesh, glm::uvec3 triangle) {
  const glm::dvec3 a(mesh.positions[triangle.x]), b(mesh.positions[triangle.y]), c(mesh.positions[triangle.z]);
  return glm::cross(b - a, c - a) != glm::dvec3(0.0);
}

/// Without materials that no triangle has.
void dropUnusedMaterials(Mesh& mesh) {
  std::vector<uint32_t> numbers(mesh.materials.size(), kNone);
  for (const uint32_t material : mesh.materialOfTriangle)
    numbers[material] = 0;
  uint32_t kept = 0;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] == kNone) continue;
    numbers[i] = kept;
    if (kept != i) mesh.materials[kept] = std::move(mesh.materials[i]);
    ++kept;
  }
  mesh.materials.resize(kept);
  for (uint32_t& material : mesh.materialOfTriangle)
    material = numbers[material];
}

}  // namespace

MeshFile tidied(RawMesh raw, bool join, const std::string& path) {
  Mesh& mesh = raw.mesh;
  MeshReport& report = raw.report;
  check(mesh.triangles.size() == mesh.materialOfTriangle.size(), "every triangle has a material");
  check(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(), "every vertex has a normal, or none");
  checkIndices(mesh, path);
  const std::vector<uint32_t> numbers = numberVertices(mesh, join && mesh.normals.empty(), report);
  size_t kept = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3 old = mesh.triangles[i];
    const glm::uvec3 triangle(numbers[old.x], numbers[old.y], numbers[old.z]);
    if (triangle.x == kNone || triangle.y == kNone || triangle.z == kNone) {
      ++report.nonFiniteTriangles;
    } else if (!hasArea(mesh, triangle)) {
      ++report.degenerateTriangles;
    } else {
      mesh.triangles[kept] = triangle;
      mesh.materialOfTriangle[kept++] = mesh.materialOfTriangle[i];
    }
  }
  mesh.triangles.resize(kept);
  mesh.materialOfTriangle.resize(kept);
  if (kept == 0) {
    throw InputError(fmt::format(
        "{}: expected triangles, found none to see ({} in the file, {} of them without area, {} with a vertex that is "
        "not finite; {} lines and points)",
        path, report.fileTriangles, report.degenerateTriangles, report.nonFiniteTriangles, report.linesAndPoints));
  }
  for (glm::vec3& normal : mesh.normals) {
    const float length = glm::length(normal);
    normal = isFinite(normal) && std::isfinite(length) && length > 0.0f ? normal / length : glm::vec3(0.0f);
  }
  dropUnusedMaterials(mesh);
  return raw;
}

void makeSmoothNormals(Mesh& mesh) {
  std::vector<glm::dvec3> sums(mesh.positions.size(), glm::dvec3(0.0));
  for (const glm::uvec3 triangle : mesh.triangles) {
    const glm::dvec3 a(mesh.positions[triangle.x]), b(mesh.positions[triangle.y]), c(mesh.positions[triangle.z]);
    const glm::dvec3 normal = glm::cross(b - a, c - a);
    for (int corner = 0; corner < 3; ++corner)
      sums[triangle[corner]] += normal;
  }
  mesh.normals.resize(sums.size());
  for (size_t i = 0; i < sums.size(); ++i) {
    const double length = glm::length(sums[i]);
    mesh.normals[i] = length > 0.0 ? glm::vec3(sums[i] / length) : glm::vec3(0.0f);
  }
}

}  // namespace freevoxel
