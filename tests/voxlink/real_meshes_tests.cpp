// The real meshes and particles: counts as data/README.md has them.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/common.hpp>

#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "voxlink/read_mesh.h"
#include "voxlink/read_spheres.h"

namespace freevoxel::test {

namespace {

class RealMesh : public testing::Test {
 protected:
  void SetUp() override {
    if (!dataFolder()) GTEST_SKIP() << kNoData;
  }
  static void bounds(const std::vector<glm::vec3>& places, glm::vec3& low, glm::vec3& high) {
    low = high = places[0];
    for (const glm::vec3 place : places) {
      low = glm::min(low, place);
      high = glm::max(high, place);
    }
  }
  static MeshFile mesh(const std::string& name) { return readMesh(*dataFolder() + "/meshes/" + name); }
  TestReader reader;
};

void expectNear(glm::vec3 found, glm::vec3 expected, float tolerance) {
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(found[axis], expected[axis], tolerance) << "axis " << axis;
}

}  // namespace

TEST_F(RealMesh, bunny) {
  const MeshFile file = mesh("bunny.ply.gz");
  EXPECT_EQ(file.report.fileVertices, 35947u);
  EXPECT_EQ(file.report.fileTriangles, 69451u);
  EXPECT_EQ(file.mesh.triangles.size() + file.report.degenerateTriangles, 69451u);
  glm::vec3 low, high;
  bounds(file.mesh.positions, low, high);
  expectNear(low, {-0.095f, 0.033f, -0.062f}, 6e-4f);
  expectNear(high, {0.061f, 0.187f, 0.059f}, 6e-4f);
}

TEST_F(RealMesh, dragons) {
  const MeshFile fine = mesh("dragon_vrip_res2.ply.gz");
  EXPECT_EQ(fine.report.fileVertices, 100250u);
  EXPECT_EQ(fine.report.fileTriangles, 202520u);
  const MeshFile coarse = mesh("dragon_vrip_res3.ply.gz");
  EXPECT_EQ(coarse.report.fileVertices, 22998u);
  EXPECT_EQ(coarse.report.fileTriangles, 47794u);
}

TEST_F(RealMesh, teapot) {
  const MeshFile file = mesh("teapot.obj.gz");
  EXPECT_EQ(file.report.fileVertices, 3644u);
  EXPECT_EQ(file.report.fileTriangles, 6320u);
}

TEST_F(RealMesh, glassHouse) {
  const MeshFile file = mesh("glass_house/scene.gltf");
  EXPECT_EQ(file.report.fileVertices, 42706u);
  EXPECT_EQ(file.report.fileTriangles, 56674u);
  EXPECT_EQ(file.mesh.materials.size(), 14u);
  const auto trianglesOf = [&](const std::string& name) {
    return std::count_if(file.mesh.materialOfTriangle.begin(), file.mesh.materialOfTriangle.end(),
                         [&](uint32_t material) { return file.mesh.materials[material].name == name; });
  };
  const auto opacityOf = [&](const std::string& name) {
    for (const Material& material : file.mesh.materials) {
      if (material.name == name) return material.opacity;
    }
    return -1.0f;
  };
  EXPECT_NEAR(double(trianglesOf("glass")), 7192.0, double(file.report.degenerateTriangles));
  EXPECT_EQ(trianglesOf("darker_glass"), 22);
  EXPECT_FLOAT_EQ(opacityOf("glass"), 0.4f);
  EXPECT_FLOAT_EQ(opacityOf("darker_glass"), 0.85f);
  const auto transparent = std::count_if(file.mesh.materials.begin(), file.mesh.materials.end(),
                                         [](const Material& material) { return material.opacity < 1.0f; });
  EXPECT_EQ(transparent, 2);
  // The root's turn of -90 degrees about x: y of the file is up now, from 0 to 150 wide along z before it.
  glm::vec3 low, high;
  bounds(file.mesh.positions, low, high);
  expectNear(low, {-60.5f, -75.0f, 0.0f}, 0.1f);
  expectNear(high, {60.5f, 75.0f, 42.6f}, 0.1f);
  const auto textures = std::count_if(file.report.notes.begin(), file.report.notes.end(), [](const std::string& note) {
    return note.find("the mean of its colours") != std::string::npos;
  });
  EXPECT_EQ(textures, 2);
}

TEST_F(RealMesh, capsid) {
  const std::string path = *dataFolder() + "/particles/1IHM.pdb";
  const SphereFile whole = readSpheres(path);
  EXPECT_EQ(whole.report.fileSpheres, 11284u);
  EXPECT_EQ(whole.report.copies, 60u);
  EXPECT_EQ(whole.spheres.centres.size(), 677040u);
  EXPECT_EQ(whole.spheres.materials.size(), 4u);  // C, N, O, S
  // An icosahedron's copies lie about its centre, the origin.
  glm::vec3 low, high;
  bounds(whole.spheres.centres, low, high);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(low[axis], -high[axis], 0.02f * high[axis]);
  EXPECT_EQ(readSpheres(path, {.copies = false}).spheres.centres.size(), 11284u);
}

TEST_F(RealMesh, crambinAndHalo) {
  EXPECT_EQ(readSpheres(*dataFolder() + "/particles/1crn.pdb").report.fileSpheres, 327u);
  const SphereFile halo = readSpheres(*dataFolder() + "/particles/halo_low_res.npy");
  EXPECT_EQ(halo.spheres.centres.size(), 32314u);
  glm::vec3 low, high;
  bounds(halo.spheres.centres, low, high);
  expectNear(low, {74.5f, 16.2f, 89.0f}, 0.1f);
  expectNear(high, {78.9f, 22.8f, 93.2f}, 0.1f);
}

}  // namespace freevoxel::test
