#include "app/traced_scene.h"

#include <fmt/core.h>

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

#include "base/error.h"
#include "hierarchy/value_grid.h"
#include "volume/transfer_presets.h"
#include "voxlink/read_mesh.h"

namespace freevoxel {

namespace {

glm::dmat3 rotationOf(const ObjectPlace& place) {
  glm::dmat4 rotation(1.0);
  for (int axis = 2; axis >= 0; --axis) {
    glm::dvec3 about(0.0);
    about[axis] = 1.0;
    rotation = glm::rotate(rotation, glm::radians(place.rotateDegrees[axis]), about);
  }
  return glm::dmat3(rotation);
}

class SceneReader {
 public:
  SceneReader(const SceneObjects& objects, Session& session) : objects_(objects), session_(session) {}

  TracedScene read() {
    for (const MeshObject& object : objects_.meshes)
      add(object);
    for (const SpheresObject& object : objects_.spheres)
      add(object);
    for (const VolumeObject& object : objects_.volumes)
      add(object);
    for (const auto& [name, change] : objects_.materials) {
      if (used_.count(name) != 0) continue;
      std::string known;
      for (const std::string& there : named_)
        known += (known.empty() ? "" : ", ") + there;
      throw InputError(fmt::format("{}: no object has a material of this name (there are: {})", change.where,
                                   known.empty() ? "none" : known));
    }
    for (const auto& [key, count] : leftOut_)
      session_.statistics[key] = count;
    return std::move(scene_);
  }

 private:
  /// The material as the scene has it: the file's, changed where it says so.
  Material changed(Material material) {
    if (!material.name.empty()) named_.insert(material.name);
    const auto found = objects_.materials.find(material.name);
    if (found == objects_.materials.end()) return material;
    used_.insert(material.name);
    const MaterialChange& change = found->second;
    if (change.kind) {
      material.kind = *change.kind;
      // Of an opaque mirror or pane only its colour would be seen.
      constexpr float kTint = 0.1f;
      if (material.kind != MaterialKind::diffuse && material.opacity == 1.0f) material.opacity = kTint;
    }
    if (change.linear) material.linear = *change.linear;
    if (change.opacity) material.opacity = *change.opacity;
    if (change.reflectance) material.reflectance = *change.reflectance;
    if (change.indexOfRefraction) material.indexOfRefraction = *change.indexOfRefraction;
    return material;
  }

  /// Materials of a file, or the one that replaces them, to the end of `all`; the number of the first.
  uint32_t addMaterials(std::vector<Material> own, const std::string& replacement, std::vector<uint32_t>& users,
                        std::vector<Material>& all) {
    if (!replacement.empty()) {
      Material material;
      if (!own.empty()) material = own[0];
      material.name = replacement;
      // A file's colour is not a named material's, unless nothing is said of it.
      if (objects_.materials.count(replacement) != 0) material = {.name = replacement};
      own = {material};
      users.assign(users.size(), 0);
    }
    const auto first = uint32_t(all.size());
    for (const Material& material : own)
      all.push_back(changed(material));
    return first;
  }

  void add(const MeshObject& object) {
    MeshFile file = session_.timed("read", [&] { return readMesh(object.file); });
    Mesh& mesh = file.mesh;
    if (object.smooth) makeSmoothNormals(mesh);
    tell(object.file, file.report.notes);
    leaveOut(object.file, "nonFiniteVertices", file.report.nonFiniteVertices, "vertices that are not finite");
    leaveOut(object.file, "nonFiniteTriangles", file.report.nonFiniteTriangles, "triangles with such a vertex");
    leaveOut(object.file, "degenerateTriangles", file.report.degenerateTriangles, "triangles without area");
    leaveOut(object.file, "linesAndPoints", file.report.linesAndPoints, "lines and points");
    const glm::dmat3 rotation = rotationOf(object.place);
    Mesh& all = scene_.mesh;
    const size_t firstVertex = all.positions.size();
    if (firstVertex + mesh.positions.size() > 0xfffffffeu) {
      throw InputError(fmt::format("{}: expected at most 2^32 - 2 vertices in the scene, found more", object.file));
    }
    const uint32_t firstMaterial =
        addMaterials(std::move(mesh.materials), object.material, mesh.materialOfTriangle, all.materials);
    // Where only some objects have normals the others' are 0: unknown.
    const bool haveNormals = !mesh.normals.empty() || !all.normals.empty();
    if (haveNormals) all.normals.resize(firstVertex, glm::vec3(0.0f));
    for (const glm::vec3 position : mesh.positions)
      all.positions.push_back(placed(position, object.place, rotation));
    if (haveNormals) {
      for (const glm::vec3 normal : mesh.normals)
        all.normals.push_back(glm::vec3(rotation * glm::dvec3(normal)));
      all.normals.resize(all.positions.size(), glm::vec3(0.0f));
    }
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
      all.triangles.push_back(mesh.triangles[i] + uint32_t(firstVertex));
      all.materialOfTriangle.push_back(mesh.materialOfTriangle[i] + firstMaterial);
    }
  }

  void add(const SpheresObject& object) {
    SphereFile file;
    if (object.file.empty()) {
      file.spheres = {{glm::vec3(object.centre)}, {*object.options.radius}, {0}, {Material()}};
    } else {
      file = session_.timed("read", [&] { return readSpheres(object.file, object.options); });
    }
    tell(object.file, file.report.notes);
    leaveOut(object.file, "nonFiniteSpheres", file.report.nonFinite, "spheres that are not finite");
    leaveOut(object.file, "spheresWithoutRadius", file.report.withoutRadius, "spheres without a radius");
    const glm::dmat3 rotation = rotationOf(object.place);
    Spheres& all = scene_.spheres;
    const uint32_t firstMaterial =
        addMaterials(std::move(file.spheres.materials), object.material, file.spheres.materialOfSphere, all.materials);
    for (size_t i = 0; i < file.spheres.centres.size(); ++i) {
      all.centres.push_back(placed(file.spheres.centres[i], object.place, rotation));
      all.radii.push_back(float(double(file.spheres.radii[i]) * object.place.scale));
      all.materialOfSphere.push_back(file.spheres.materialOfSphere[i] + firstMaterial);
    }
  }

  void add(const VolumeObject& object) {
    Volume volume = session_.timed("read", [&] { return readVolume(object.file, object.raw); });
    if (object.transfer.empty()) {
      throw InputError(
          fmt::format("{}: expected a transfer function for this volume: give it a key 'transfer'", object.file));
    }
    SceneVolume added;
    added.transfer = chooseTransfer(object.transfer, volume);
    volume.header.labels = volume.header.labels || added.transfer.isLabels;
    Placement& placement = volume.header.placement;
    const glm::dmat3 rotation = rotationOf(object.place);
    placement.direction = rotation * placement.direction;
    placement.spacing *= object.place.scale;
    placement.origin = object.place.translate + rotation * (placement.origin * object.place.scale);
    added.grid = session_.timed("read", [&] { return valueGrid(volume, added.transfer); });
    scene_.volumes.push_back(std::move(added));
  }

  static glm::vec3 placed(glm::vec3 position, const ObjectPlace& place, const glm::dmat3& rotation) {
    return glm::vec3(place.translate + rotation * (glm::dvec3(position) * place.scale));
  }

  void tell(const std::string& file, const std::vector<std::string>& notes) {
    for (const std::string& note : notes)
      session_.warn(fmt::format("{}: {}", file, note));
  }
  void leaveOut(const std::string& file, const char* key, uint64_t count, const char* what) {
    leftOut_[key] += count;
    if (count > 0) session_.warn(fmt::format("{}: {} {} are left out", file, count, what));
  }

  const SceneObjects& objects_;
  Session& session_;
  TracedScene scene_;
  std::set<std::string> named_, used_;
  std::map<std::string, uint64_t> leftOut_;
};

}  // namespace

TracedScene readTracedScene(const SceneObjects& objects, Session& session) {
  return SceneReader(objects, session).read();
}

SceneObjects sceneOfFile(const std::string& path) {
  SceneObjects objects;
  if (isMeshFile(path)) {
    objects.meshes.push_back({.file = path});
  } else {
    objects.spheres.push_back({.file = path});
  }
  return objects;
}

}  // namespace freevoxel
