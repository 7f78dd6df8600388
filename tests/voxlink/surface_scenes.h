// Meshes, spheres and volumes for the tests of scenes.
#pragma once

#include <cmath>
#include <numbers>

#include "tests/voxlink/voxlink_scenes.h"
#include "voxlink/scene.h"

namespace freevoxel::test {

inline uint32_t addMaterial(Mesh& mesh, glm::vec3 linear, MaterialKind kind = MaterialKind::diffuse,
                            float opacity = 1.0f, float reflectance = 0.1f, float index = 1.5f) {
  mesh.materials.push_back({"", kind, linear, opacity, reflectance, index});
  return uint32_t(mesh.materials.size() - 1);
}

/// The parallelogram corner, corner + a, corner + a + b, corner + b; a x b is outside.
inline void addQuad(Mesh& mesh, glm::vec3 corner, glm::vec3 a, glm::vec3 b, uint32_t material) {
  const uint32_t n = uint32_t(mesh.positions.size());
  for (const glm::vec3 p : {corner, corner + a, corner + a + b, corner + b})
    mesh.positions.push_back(p);
  for (const glm::uvec3 t : {glm::uvec3(n, n + 1, n + 2), glm::uvec3(n, n + 2, n + 3)}) {
    mesh.triangles.push_back(t);
    mesh.materialOfTriangle.push_back(material);
  }
  if (!mesh.normals.empty()) mesh.normals.resize(mesh.positions.size(), glm::normalize(glm::cross(a, b)));
}

/// An ellipsoid of triangles. With normals if the mesh has had any, or nothing at all.
inline void addEllipsoid(Mesh& mesh, glm::vec3 centre, glm::vec3 radii, int parts, uint32_t material, bool normals) {
  const uint32_t n = uint32_t(mesh.positions.size());
  if (normals) mesh.normals.resize(n, glm::vec3(0.0f));
  for (int i = 0; i <= parts; ++i) {
    for (int j = 0; j < 2 * parts; ++j) {
      const double polar = std::numbers::pi * i / parts, turn = std::numbers::pi * j / parts;
      const glm::vec3 unit(std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn));
      mesh.positions.push_back(centre + radii * unit);
      if (normals) mesh.normals.push_back(glm::normalize(unit / radii));
    }
  }
  const auto vertex = [&](int i, int j) { return n + uint32_t(i * 2 * parts + j % (2 * parts)); };
  for (int i = 0; i < parts; ++i) {
    for (int j = 0; j < 2 * parts; ++j) {
      const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
        if (mesh.positions[a] == mesh.positions[b] || mesh.positions[b] == mesh.positions[c]) return;
        mesh.triangles.push_back({a, b, c});
        mesh.materialOfTriangle.push_back(material);
      };
      add(vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1));
      add(vertex(i, j), vertex(i + 1, j + 1), vertex(i + 1, j));
    }
  }
}

inline void addSphere(Spheres& spheres, glm::vec3 centre, float radius, uint32_t material) {
  spheres.centres.push_back(centre);
  spheres.radii.push_back(radius);
  spheres.materialOfSphere.push_back(material);
}

/// A floor, a leaning wall, glass and mirror ellipsoids, spheres, and a small volume; 5 x 7 x 11 in size.
inline TracedScene mixedScene(bool withVolume, bool withNormals) {
  TracedScene scene;
  Mesh& mesh = scene.mesh;
  const uint32_t sand = addMaterial(mesh, {0.7f, 0.6f, 0.4f}), blue = addMaterial(mesh, {0.1f, 0.2f, 0.8f});
  const uint32_t glass = addMaterial(mesh, {0.9f, 1.0f, 0.9f}, MaterialKind::glass, 0.05f, 0.1f, 1.5f);
  const uint32_t mirror = addMaterial(mesh, {0.9f, 0.9f, 0.9f}, MaterialKind::mirror, 0.1f);
  const uint32_t curtain = addMaterial(mesh, {0.9f, 0.2f, 0.1f}, MaterialKind::diffuse, 0.4f);
  addEllipsoid(mesh, {-1.0f, 1.2f, 1.0f}, {0.9f, 1.1f, 0.7f}, 14, glass, withNormals);
  addEllipsoid(mesh, {1.1f, 1.0f, -2.0f}, {0.8f, 0.8f, 0.8f}, 12, mirror, withNormals);
  addQuad(mesh, {-2.5f, 0.0f, 5.5f}, {5.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -11.0f}, sand);
  addQuad(mesh, {-2.4f, 0.1f, -5.2f}, {4.6f, 0.3f, 0.4f}, {0.2f, 6.5f, -0.2f}, blue);
  addQuad(mesh, {0.3f, 0.2f, 2.5f}, {1.3f, 0.0f, 0.3f}, {0.0f, 2.1f, 0.0f}, curtain);
  scene.spheres.materials = {{"", MaterialKind::diffuse, glm::vec3(0.2f, 0.8f, 0.3f)},
                             {"", MaterialKind::glass, glm::vec3(1.0f), 0.02f, 0.08f, 1.4f}};
  addSphere(scene.spheres, {1.5f, 0.6f, 1.5f}, 0.6f, 1);
  addSphere(scene.spheres, {-1.6f, 0.4f, 3.5f}, 0.4f, 0);
  addSphere(scene.spheres, {-1.2f, 3.6f, -1.0f}, 0.03f, 0);
  if (withVolume) {
    VoxLinkScene volume = floatScene();
    volume.volume.header.placement.origin = {-0.5, 2.0, -4.0};
    volume.volume.header.placement.spacing = {0.1, 0.2, 0.09};
    scene.volumes.push_back({volume.grid(), volume.transfer});
  }
  return scene;
}

inline Lighting twoLamps() {
  Lighting lighting;
  lighting.ambient = 0.2f;
  lighting.shading = Shading::phong;
  lighting.lights = {{true, {0.5, 1.0, 0.6}, glm::vec3(0.7f, 0.7f, 0.6f)}, {false, {-2.0, 6.0, 4.0}, glm::vec3(0.3f)}};
  return lighting;
}

}  // namespace freevoxel::test
