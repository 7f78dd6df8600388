// Meshes from tiny files written here: what is read, what is left out, what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>

#include "base/address_sanitizer.h"
#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "voxlink/raw_mesh.h"
#include "voxlink/read_assimp.h"
#include "voxlink/read_mesh.h"

namespace freevoxel::test {

namespace {

/// Corners of a tetrahedron that differ along every axis.
const std::string kPly =
    "ply\nformat ascii 1.0\ncomment four corners\nelement vertex 4\nproperty float x\nproperty float y\nproperty float "
    "z\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 2 0\n0 0 3\n3 0 2 1\n3 0 1 "
    "3\n4 0 1 2 3\n";
const std::string kObj =
    "mtllib t.mtl\nv 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nusemtl red\nf 1 3 2\nf 1 2 4\nusemtl pane\nf 1 2 3 4\n";
const std::string kMtl = "newmtl red\nKd 1 0 0\nnewmtl pane\nKd 0 0.5 1\nd 0.25\n";
const std::string kStl =
    "solid t\nfacet normal 0 0 -1\nouter loop\nvertex 0 0 0\nvertex 0 2 0\nvertex 1 0 0\nendloop\nendfacet\n"
    "facet normal 0 -1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 3\nendloop\nendfacet\nendsolid t\n";

std::string binaryStl() {
  Bytes bytes;
  bytes.text("solid in spite of its name").zeros(80 - 26).add(uint32_t(2));
  const glm::vec3 a(0.0f), b(1.0f, 0.0f, 0.0f), c(0.0f, 2.0f, 0.0f), d(0.0f, 0.0f, 3.0f);
  for (const auto& corners : {std::array{a, c, b}, std::array{a, b, d}}) {
    bytes.zeros(12);
    for (const glm::vec3 corner : corners)
      bytes.add(corner.x).add(corner.y).add(corner.z);
    bytes.zeros(2);
  }
  return bytes.str();
}

std::string binaryPly(ByteOrder order) {
  Bytes bytes(order);
  bytes.text("ply\nformat ").text(order == ByteOrder::big ? "binary_big_endian" : "binary_little_endian");
  bytes.text(
      " 1.0\nelement vertex 4\nproperty double x\nproperty float y\nproperty short z\nproperty uchar red\nproperty "
      "uchar "
      "green\nproperty uchar blue\nelement face 3\nproperty uchar flags\nproperty list uchar uint "
      "vertex_index\nelement edge 1\nproperty list int short anything\nend_header\n");
  const auto vertex = [&](double x, float y, int16_t z) {
    bytes.add(x).add(y).add(z).add(uint8_t(255)).add(uint8_t(0)).add(uint8_t(0));
  };
  vertex(0.0, 0.0f, 0);
  vertex(1.0, 0.0f, 0);
  vertex(0.0, 2.0f, 0);
  vertex(0.0, 0.0f, 3);
  const auto face = [&](std::initializer_list<uint32_t> corners) {
    bytes.add(uint8_t(7)).add(uint8_t(corners.size()));
    for (const uint32_t corner : corners)
      bytes.add(corner);
  };
  face({0, 2, 1});
  face({0, 1, 3});
  face({0, 1, 2, 3});
  bytes.add(int32_t(2)).add(int16_t(5)).add(int16_t(6));
  return bytes.str();
}

/// Two triangles of four corners, moved by (10,20,30) and mirrored along x.
std::string gltf(const std::string& buffer, const std::string& material, const std::string& more = "") {
  return "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0,"
         "\"translation\":[10,20,30],\"scale\":[-1,1,1]}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}"
         ","
         "\"indices\":1,\"material\":0}]}],\"materials\":[" +
         material +
         "],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\",\"min\":[0,0,0],"
         "\"max\":"
         "[1,2,3]},{\"bufferView\":1,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],\"bufferViews\":[{"
         "\"buffer\":0,\"byteOffset\":0,\"byteLength\":48},{\"buffer\":0,\"byteOffset\":48,\"byteLength\":12}],"
         "\"buffers\""
         ":[{\"byteLength\":60" +
         buffer + "}]" + more + "}";
}

std::string gltfBuffer() {
  Bytes bytes;
  for (const glm::vec3 corner : {glm::vec3(0.0f), glm::vec3(1, 0, 0), glm::vec3(0, 2, 0), glm::vec3(0, 0, 3)})
    bytes.add(corner.x).add(corner.y).add(corner.z);
  for (const uint16_t index : {0, 2, 1, 0, 1, 3})
    bytes.add(index);
  return bytes.str();
}

const std::string kGlass =
    "{\"name\":\"glass\",\"alphaMode\":\"BLEND\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.5,0.25,1,0.25]}}";

std::string glb() {
  std::string json = gltf("", kGlass);
  json.append(3 - (json.size() + 3) % 4, ' ');
  const std::string buffer = gltfBuffer();
  Bytes bytes;
  bytes.text("glTF").add(uint32_t(2)).add(uint32_t(12 + 8 + json.size() + 8 + buffer.size()));
  bytes.add(uint32_t(json.size())).text("JSON").text(json);
  bytes.add(uint32_t(buffer.size())).text("BIN").zeros(1).text(buffer);
  return bytes.str();
}

/// Where the triangles of the tetrahedron are, whatever the numbers of its corners.
std::vector<glm::vec3> corners(const Mesh& mesh) {
  std::vector<glm::vec3> places;
  for (const glm::uvec3 triangle : mesh.triangles) {
    for (int corner = 0; corner < 3; ++corner)
      places.push_back(mesh.positions[triangle[corner]]);
  }
  return places;
}

/// As readMesh, but in this process: starting another one takes a while.
MeshFile readHere(const std::string& path, AssimpFormat format) {
  return tidied(readWithAssimp(path, format), format != AssimpFormat::gltf, path);
}

const glm::vec3 kA(0.0f), kB(1.0f, 0.0f, 0.0f), kC(0.0f, 2.0f, 0.0f), kD(0.0f, 0.0f, 3.0f);

bool mentions(const std::vector<std::string>& notes, const std::string& text) {
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

}  // namespace

TEST(ReadPly, aTetrahedron) {
  const MeshFile file = readMesh(fileOf(kPly, "t.ply"));
  EXPECT_EQ(file.report.format, "PLY");
  EXPECT_EQ(file.report.fileVertices, 4u);
  EXPECT_EQ(file.report.fileTriangles, 4u);
  EXPECT_EQ(file.mesh.positions, (std::vector<glm::vec3>{kA, kB, kC, kD}));
  EXPECT_EQ(corners(file.mesh), (std::vector<glm::vec3>{kA, kC, kB, kA, kB, kD, kA, kB, kC, kA, kC, kD}));
  EXPECT_EQ(file.mesh.materials, std::vector<Material>(1));
  EXPECT_TRUE(file.mesh.normals.empty());
}

TEST(ReadPly, compressed) {
  EXPECT_EQ(corners(readMesh(fileOf(gzip(kPly), "t.ply.gz")).mesh).size(), 12u);
  const std::string cut = gzip(kPly).substr(0, gzip(kPly).size() - 3);
  inputError([&] { readMesh(fileOf(cut, "t.ply.gz")); });
}

TEST(ReadPly, bothByteOrders) {
  for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
    const MeshFile file = readMesh(fileOf(binaryPly(order), "t.ply"));
    EXPECT_EQ(corners(file.mesh), (std::vector<glm::vec3>{kA, kC, kB, kA, kB, kD, kA, kB, kC, kA, kC, kD}));
    EXPECT_EQ(file.mesh.materials[0].linear, glm::vec3(1, 0, 0));
    EXPECT_TRUE(mentions(file.report.notes, "colours of vertices"));
  }
}

TEST(ReadPly, everyTruncationIsRefused) {
  for (const std::string& bytes : {kPly, binaryPly(ByteOrder::little), binaryPly(ByteOrder::big)}) {
    const std::string path = fileOf(bytes, "t.ply");
    expectTruncationsFail(path, [&] { readMesh(path); });
    writeBytes(path, bytes + "1");
    inputError([&] { readMesh(path); });
  }
}

TEST(ReadPly, saysWhere) {
  const auto error = [](const std::string& from, const std::string& to) {
    std::string bytes = kPly;
    bytes.replace(bytes.find(from), from.size(), to);
    const std::string path = fileOf(bytes, "t.ply");
    return inputError([&] { readMesh(path); }).substr(path.size());
  };
  EXPECT_EQ(error("0 2 0", "0 two 0"), ": line 13: expected a vertex's value, found 'two'");
  EXPECT_EQ(error("3 0 1 3", "3 0 1 4"), ": triangle 1: expected vertices from 0 to below 4, found 4");
  EXPECT_EQ(error("3 0 1 3", "3 0 1 -1"),
            ": line 16: expected the number of a vertex, a whole number from 0 to 4294967294, found -1");
  EXPECT_EQ(error("vertex 4", "vertex 4000000000"),
            ": line 11: expected 4000000000 elements 'vertex' of at least 6 bytes each, found 50 bytes");
  EXPECT_NE(error("vertex 4", "vertex 18446744073709551615").find("expected 18446744073709551615 elements"),
            std::string::npos);
  EXPECT_EQ(error("float z", "half z"), ": line 7: expected a type such as float or uchar, found 'half'");
  EXPECT_EQ(error("ascii 1.0", "ascii 2.0"), ": line 2: expected format ascii or binary_..._endian 1.0");
  EXPECT_NE(error("property float z\n", "").find("expected properties x, y and z"), std::string::npos);
}

TEST(ReadMesh, whatCannotBeSeenIsCountedAndLeftOut) {
  // A corner that is not finite, one triangle that uses it, one with two equal corners, one along a line, an edge.
  const MeshFile file = readMesh(fileOf(
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nelement face "
      "5\nproperty list uchar int vertex_indices\nend_header\n0 0 0\nnan 0 0\n1 0 0\n0 2 0\n2 0 0\n0 -inf 0\n3 0 1 "
      "2\n3 0 2 "
      "3\n3 0 2 2\n3 0 2 4\n2 0 3\n",
      "t.ply"));
  EXPECT_EQ(file.report.nonFiniteVertices, 2u);
  EXPECT_EQ(file.report.nonFiniteTriangles, 1u);
  EXPECT_EQ(file.report.degenerateTriangles, 2u);
  EXPECT_EQ(file.report.linesAndPoints, 1u);
  EXPECT_EQ(corners(file.mesh), (std::vector<glm::vec3>{kA, kB, kC}));
  EXPECT_EQ(file.mesh.positions.size(), 4u);
}

TEST(ReadMesh, withoutTriangles) {
  const std::string text = inputError([] {
    readMesh(
        fileOf("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
               "z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n3 0 1 1\n",
               "t.ply"));
  });
  EXPECT_NE(text.find("expected triangles, found none to see (1 in the file, 1 of them without area"),
            std::string::npos)
      << text;
  for (const std::string bytes : {"v 0 0 0\nv 1 0 0\nv 0 1 0\n# nothing\n", ""}) {
    const std::string path = fileOf(bytes, "t.obj");
    inputError([&] { readHere(path, AssimpFormat::obj); });
  }
  inputError([] { readMesh(fileOf("", "t.ply")); });
  inputError([] { readMesh(fileOf("anything", "t.mesh")); });
  inputError([] { readMesh("/nonexistent/t.obj"); });
}

TEST(ReadMesh, objWithItsMaterials) {
  TestReader reader;
  const std::string path = fileOf(kObj, "t.obj");
  writeBytes(std::filesystem::path(path).parent_path() / "t.mtl", kMtl);
  const MeshFile file = readMesh(path);
  EXPECT_EQ(file.report.format, "OBJ");
  EXPECT_EQ(file.report.fileVertices, 4u);
  EXPECT_EQ(file.mesh.positions.size(), 4u) << "corners of several triangles are one vertex";
  EXPECT_EQ(corners(file.mesh).size(), 12u);
  EXPECT_EQ(corners(file.mesh)[1], kC);
  ASSERT_EQ(file.mesh.materials.size(), 2u);
  const Material& red = file.mesh.materials[file.mesh.materialOfTriangle[0]];
  const Material& pane = file.mesh.materials[file.mesh.materialOfTriangle[3]];
  EXPECT_EQ(red.name, "red");
  EXPECT_EQ(red.linear, glm::vec3(1, 0, 0));
  EXPECT_EQ(pane.name, "pane");
  EXPECT_NEAR(pane.linear.g, 0.2140f, 1e-4f);  // sRGB 0.5
  EXPECT_EQ(pane.opacity, 0.25f);
  EXPECT_EQ(pane.kind, MaterialKind::diffuse) << "glass is what the scene calls so";
  EXPECT_EQ(corners(readHere(fileOf(gzip(kObj), "t.obj.gz"), AssimpFormat::obj).mesh).size(), 12u);
  const std::string text = inputError([] { readMesh(fileOf("f 1 2 3\n", "t.obj")); });
  EXPECT_NE(text.find("line 1: expected a vertex from 1 to 0, found 3"), std::string::npos) << text;
}

TEST(ReadMesh, missingFilesAreNotedOrRefused) {
  const MeshFile file = readHere(fileOf(kObj, "t.obj"), AssimpFormat::obj);
  EXPECT_TRUE(mentions(file.report.notes, "t.mtl is missing"));
  EXPECT_EQ(corners(file.mesh).size(), 12u);
  const std::string text =
      inputError([] { readHere(fileOf(gltf(",\"uri\":\"none.bin\"", kGlass), "t.gltf"), AssimpFormat::gltf); });
  EXPECT_NE(text.find("none.bin"), std::string::npos) << text;
  const std::string path =
      fileOf(gltf(",\"uri\":\"t.bin\"", "{\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0}}}",
                  ",\"textures\":[{\"source\":0}],\"images\":[{\"uri\":\"none.png\"}]"),
             "t.gltf");
  writeBytes(std::filesystem::path(path).parent_path() / "t.bin", gltfBuffer());
  const MeshFile textured = readHere(path, AssimpFormat::gltf);
  EXPECT_TRUE(mentions(textured.report.notes, "texture none.png left out"));
  EXPECT_EQ(textured.mesh.materials[0].linear, glm::vec3(1.0f));
}

TEST(ReadMesh, stlTextAndBinary) {
  for (const std::string& bytes : {kStl, binaryStl()}) {
    const MeshFile file = readHere(fileOf(bytes, "t.stl"), AssimpFormat::stl);
    EXPECT_EQ(file.report.format, "STL");
    EXPECT_EQ(corners(file.mesh), (std::vector<glm::vec3>{kA, kC, kB, kA, kB, kD}));
    EXPECT_EQ(file.mesh.positions.size(), 4u);
    EXPECT_TRUE(file.mesh.normals.empty());
  }
}

TEST(ReadMesh, gltfPlacesMirrorsAndColours) {
  const std::string separate = fileOf(gltf(",\"uri\":\"t.bin\"", kGlass), "t.gltf");
  writeBytes(std::filesystem::path(separate).parent_path() / "t.bin", gltfBuffer());
  for (const std::string& path : {separate, fileOf(glb(), "t.glb")}) {
    const MeshFile file = readHere(path, AssimpFormat::gltf);
    EXPECT_EQ(file.report.format, "glTF");
    EXPECT_EQ(file.report.fileVertices, 4u);
    const auto placed = [](glm::vec3 p) { return glm::vec3(10.0f - p.x, 20.0f + p.y, 30.0f + p.z); };
    // Mirrored, so counter-clockwise goes the other way.
    EXPECT_EQ(corners(file.mesh),
              (std::vector<glm::vec3>{placed(kA), placed(kB), placed(kC), placed(kA), placed(kD), placed(kB)}));
    ASSERT_EQ(file.mesh.materials.size(), 1u);
    EXPECT_EQ(file.mesh.materials[0].name, "glass");
    EXPECT_EQ(file.mesh.materials[0].kind, MaterialKind::diffuse);
    EXPECT_EQ(file.mesh.materials[0].opacity, 0.25f);
    EXPECT_EQ(file.mesh.materials[0].linear, glm::vec3(0.5f, 0.25f, 1.0f));
  }
}

TEST(ReadMesh, gltfRefusesWhatItDoesNotUnderstand) {
  const auto error = [](const std::string& bytes, const std::string& name) {
    const std::string path = fileOf(bytes, name);
    return inputError([&] { readWithAssimp(path, AssimpFormat::gltf); });
  };
  const std::string draco = gltf("", kGlass, ",\"extensionsRequired\":[\"KHR_draco_mesh_compression\"]");
  EXPECT_NE(error(draco, "t.gltf").find("KHR_draco_mesh_compression"), std::string::npos);
  error("{\"asset\":{\"version\":\"1.0\"}}", "t.gltf");
  error("[]", "t.gltf");
  error("{", "t.gltf");
}

/// The reader in this process: a child for each length would take minutes. Assimp dying of one would end the tests.
TEST(ReadWithAssimp, everyTruncation) {
  const auto everyLength = [](const std::string& bytes, const std::string& name, AssimpFormat format,
                              const std::function<size_t(const std::string&)>& mostTriangles) {
    const std::string path = fileOf(bytes, name);
    // Assimp takes 10 ms to start, and ten times as long under the sanitizers.
    const size_t step = kUnderAddressSanitizer ? 11 : 1;
    for (size_t length = 0; length < bytes.size(); length += step) {
      const std::string part = bytes.substr(0, length);
      writeBytes(path, part);
      try {
        const RawMesh raw = readWithAssimp(path, format);
        EXPECT_LE(raw.mesh.triangles.size(), mostTriangles(part)) << name << " cut to " << length;
      } catch (const InputError& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
    }
  };
  const auto none = [](const std::string&) { return size_t(0); };
  everyLength(glb(), "t.glb", AssimpFormat::gltf, none);
  everyLength(binaryStl(), "t.stl", AssimpFormat::stl, none);
  // Without its last new line the file is whole.
  everyLength(kStl.substr(0, kStl.size() - 2), "t.stl", AssimpFormat::stl, [](const std::string& part) {
    return part.find("endsolid") != std::string::npos ? size_t(2) : size_t(0);
  });
  everyLength(kObj, "t.obj", AssimpFormat::obj, [](const std::string& part) {
    const auto has = [&](const char* line) { return size_t(part.find(line) != std::string::npos); };
    return has("f 1 3 2\n") + has("f 1 2 4\n") + 2 * has("f 1 2 3 4\n");
  });
}

TEST(ReadWithAssimp, objSaysWhere) {
  const auto error = [](const std::string& bytes) {
    const std::string path = fileOf(bytes, "t.obj");
    return inputError([&] { readWithAssimp(path, AssimpFormat::obj); }).substr(path.size());
  };
  const std::string start = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(error(start + "f 1 2 4\n"), ": line 4: expected a vertex from 1 to 3, found 4");
  EXPECT_EQ(error(start + "f 1 2 0\n"), ": line 4: expected a corner such as 3, 3/1 or 3//2, found '0'");
  EXPECT_EQ(error(start + "f 1 2 -4\n"), ": line 4: expected at most 3 back, found '-4'");
  EXPECT_EQ(error(start + "f 1//1 2//1 3//1\n"), ": line 4: expected a normal from 1 to 0, found 1");
  EXPECT_EQ(error(start + "f 1 2\n"), ": line 4: expected a face of at least 3 corners, found 2");
  EXPECT_EQ(error(start + "v 1 x 0\n"), ": line 4: expected a number, found 'x'");
  EXPECT_EQ(error(start + "v 1 0\n"), ": line 4: expected 3 numbers after v, found 2");
}

TEST(ReadWithAssimp, stlSaysWhere) {
  const auto error = [](const std::string& bytes) {
    const std::string path = fileOf(bytes, "t.stl");
    return inputError([&] { readWithAssimp(path, AssimpFormat::stl); }).substr(path.size());
  };
  EXPECT_EQ(error("solid t\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nendloop\nendfacet\nendsolid\n"),
            ": line 6: expected a facet of 3 vertices, found 1");
  EXPECT_EQ(error(Bytes().zeros(80).add(uint32_t(4000000000u)).zeros(50).str()),
            ": offset 80: expected 200000000084 bytes for 4000000000 triangles, found 134");
}

TEST(SmoothNormals, ofACorner) {
  Mesh mesh = readMesh(fileOf(kPly, "t.ply")).mesh;
  mesh.triangles.resize(2);
  makeSmoothNormals(mesh);
  // Of the two triangles at vertex 0, whose areas are 1 and 1.5: (0, 0, -2) + (0, -3, 0).
  const glm::vec3 expected = glm::normalize(glm::vec3(0, -3, -2));
  EXPECT_NEAR(glm::distance(mesh.normals[0], expected), 0.0f, 1e-6f);
  EXPECT_EQ(mesh.normals[2], glm::vec3(0, 0, -1));
  EXPECT_EQ(mesh.normals[3], glm::vec3(0, -1, 0));
}

}  // namespace freevoxel::test
