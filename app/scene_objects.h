// What a scene file names beside one volume: meshes, spheres, several volumes, materials.
#pragma once

#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "volume/json_reading.h"
#include "volume/read_volume.h"
#include "voxlink/material.h"
#include "voxlink/read_spheres.h"

namespace freevoxel {

/// Where an object goes: scaled about its origin, turned about x, then y, then z, moved.
struct ObjectPlace {
  double scale = 1.0;  ///< > 0
  glm::dvec3 rotateDegrees{0.0};
  glm::dvec3 translate{0.0};
};

struct VolumeObject {
  std::string file, transfer;  ///< transfer empty: the scene's
  VolumeOptions raw;
  ObjectPlace place;
};

struct MeshObject {
  std::string file;
  std::string material;  ///< of all its triangles; empty: the file's
  bool smooth = false;   ///< normals made anew at its vertices
  ObjectPlace place;
};

struct SpheresObject {
  std::string file;  ///< empty: one sphere
  glm::dvec3 centre{0.0};
  SphereOptions options;  ///< of one sphere, its radius
  std::string material;   ///< of all; empty: the file's
  ObjectPlace place;
};

/// What the scene says of the material of a name; the rest is the file's.
struct MaterialChange {
  std::string where;  ///< file, line and key, for errors
  std::optional<MaterialKind> kind;
  std::optional<glm::vec3> linear;
  std::optional<float> opacity, reflectance, indexOfRefraction;
};

struct SceneObjects {
  std::vector<VolumeObject> volumes;
  std::vector<MeshObject> meshes;
  std::vector<SpheresObject> spheres;
  std::map<std::string, MaterialChange> materials;

  bool empty() const { return volumes.empty() && meshes.empty() && spheres.empty(); }
};

/// Of the keys volumes, meshes, spheres and materials. Throws InputError with the line.
SceneObjects readSceneObjects(const JsonPlace& scene, const std::string& scenePath);

}  // namespace freevoxel
