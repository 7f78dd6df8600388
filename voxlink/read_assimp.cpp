#include "voxlink/read_assimp.h"

#include <assimp/BaseImporter.h>
#include <assimp/GltfMaterial.h>
#include <assimp/importerdesc.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cstring>
#include <filesystem>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <set>

#include "base/error.h"
#include "base/image.h"
#include "volume/text_parsing.h"
#include "volume/whole_file.h"
#include "voxlink/mesh_checks.h"

namespace freevoxel {

namespace {

namespace fs = std::filesystem;

constexpr size_t kLargestFile = size_t(1) << 36;

/// A file in memory.
class MemoryStream final : public Assimp::IOStream {
 public:
  explicit MemoryStream(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  size_t Read(void* buffer, size_t size, size_t count) override {
    if (size == 0) return 0;
    const size_t whole = std::min(count, (bytes_.size() - at_) / size);
    std::memcpy(buffer, bytes_.data() + at_, whole * size);
    at_ += whole * size;
    return whole;
  }
  size_t Write(const void*, size_t, size_t) override { return 0; }
  aiReturn Seek(size_t offset, aiOrigin origin) override {
    const size_t from = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? at_ : bytes_.size();
    // An offset below 0 comes as a huge one: sums that wrap go back.
    const size_t to = from + offset;
    if (to > bytes_.size()) return aiReturn_FAILURE;
    at_ = to;
    return aiReturn_SUCCESS;
  }
  size_t Tell() const override { return at_; }
  size_t FileSize() const override { return bytes_.size(); }
  void Flush() override {}

 private:
  std::vector<std::byte> bytes_;
  size_t at_ = 0;
};

/// What Assimp may open: the mesh, already in memory, and files that it names.
class MeshFiles final : public Assimp::IOSystem {
 public:
  MeshFiles(std::string name, std::vector<std::byte> bytes) : name_(std::move(name)), bytes_(std::move(bytes)) {}

  bool Exists(const char* path) const override {
    std::error_code ignored;
    return path == name_ || fs::is_regular_file(path, ignored);
  }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* path, const char*) override {
    if (path == name_) return new MemoryStream(bytes_);
    if (!Exists(path)) {
      missing_.insert(path);
      return nullptr;
    }
    return new MemoryStream(readWholeFile(path, kLargestFile));
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

  const std::set<std::string>& missing() const { return missing_; }

 private:
  std::string name_;
  std::vector<std::byte> bytes_;
  std::set<std::string> missing_;
};

/// "house.obj" of "house.obj.gz": Assimp goes by the end of the name.
std::string withoutGz(const std::string& path) {
  return lowerCase(fs::path(path).extension().string()) == ".gz" ? path.substr(0, path.size() - 3) : path;
}

/// Leaves the importer with the reader of one format only, whatever the content looks like.
void keepOnly(Assimp::Importer& importer, const std::string& extension) {
  for (size_t i = importer.GetImporterCount(); i-- > 0;) {
    const std::vector<std::string_view> extensions = words(importer.GetImporterInfo(i)->mFileExtensions);
    if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
      // What is no longer registered is no longer the importer's to delete.
      const std::unique_ptr<Assimp::BaseImporter> loader(importer.GetImporter(i));
      importer.UnregisterLoader(loader.get());
    }
  }
}

glm::vec3 fromAssimp(const aiVector3D& v) {
  return {float(v.x), float(v.y), float(v.z)};
}

glm::dmat4 fromAssimp(const aiMatrix4x4& m) {
  glm::dmat4 result(1.0);
  for (unsigned row = 0; row < 4; ++row) {
    for (unsigned column = 0; column < 4; ++column)
      result[int(column)][int(row)] = double(m[row][column]);
  }
  return result;
}

/// The colour in a texture that a material names, or null; what ails it is a note.
std::optional<MeanColour> textureOf(const aiScene& scene, const aiMaterial& material, const std::string& folder,
                                    std::vector<std::string>& notes) {
  aiString name;
  if (material.GetTexture(aiTextureType_BASE_COLOR, 0, &name) != aiReturn_SUCCESS &&
      material.GetTexture(aiTextureType_DIFFUSE, 0, &name) != aiReturn_SUCCESS) {
    return std::nullopt;
  }
  const std::string written = name.C_Str();
  try {
    MeanColour mean;
    if (const aiTexture* inside = scene.GetEmbeddedTexture(name.C_Str())) {
      if (inside->mHeight != 0) {
        notes.push_back(fmt::format("texture {}: raw texels are not understood, left out", written));
        return std::nullopt;
      }
      std::string extension = inside->achFormatHint;
      std::replace(extension.begin(), extension.end(), '*', '\0');
      mean = meanOfTexture("texture." + std::string(extension.c_str()),
                           {reinterpret_cast<const char*>(inside->pcData), inside->mWidth});
    } else {
      std::string path = written;
      std::replace(path.begin(), path.end(), '\\', '/');
      mean = meanOfTexture((fs::path(folder) / path).string());
    }
    notes.push_back(fmt::format("texture {}: the mean of its colours", written));
    return mean;
  } catch (const InputError& error) {
    notes.push_back(fmt::format("texture {} left out: {}", written, error.what()));
    return std::nullopt;
  }
}

Material materialOf(const aiScene& scene, const aiMaterial& from, AssimpFormat format, const std::string& folder,
                    std::vector<std::string>& notes) {
  Material material;
  aiString name;
  if (from.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS) material.name = name.C_Str();
  if (format == AssimpFormat::stl) return material;
  aiColor4D base;
  float alpha = 1.0f;
  const auto clamped = [](float value) { return value >= 0.0f ? std::min(value, 1.0f) : 0.0f; };
  if (format == AssimpFormat::gltf) {
    // The factor is linear.
    if (from.Get(AI_MATKEY_BASE_COLOR, base) == aiReturn_SUCCESS) {
      material.linear = {clamped(base.r), clamped(base.g), clamped(base.b)};
      alpha = clamped(base.a);
    }
  } else if (aiColor3D diffuse; from.Get(AI_MATKEY_COLOR_DIFFUSE, diffuse) == aiReturn_SUCCESS &&
                                material.name != AI_DEFAULT_MATERIAL_NAME) {
    material.linear = {linearFromSrgb(diffuse.r), linearFromSrgb(diffuse.g), linearFromSrgb(diffuse.b)};
    if (float opacity = 1.0f; from.Get(AI_MATKEY_OPACITY, opacity) == aiReturn_SUCCESS) alpha = clamped(opacity);
  }
  bool blends = format == AssimpFormat::obj;
  if (aiString mode; from.Get(AI_MATKEY_GLTF_ALPHAMODE, mode) == aiReturn_SUCCESS)
    blends = std::string_view(mode.C_Str()) == "BLEND";
  if (const std::optional<MeanColour> texture = textureOf(scene, from, folder, notes)) {
    material.linear *= texture->linear;
    alpha *= texture->alpha;
  }
  material.opacity = blends ? alpha : 1.0f;
  float transmission = 0.0f;
  if (from.Get(AI_MATKEY_TRANSMISSION_FACTOR, transmission) == aiReturn_SUCCESS && transmission > 0.0f) {
    material.kind = MaterialKind::glass;
    material.opacity *= 1.0f - clamped(transmission);
  }
  return material;
}

/// Adds a mesh as a node places it.
void addMesh(const aiMesh& from, const glm::dmat4& worldFromMesh, RawMesh& raw) {
  Mesh& mesh = raw.mesh;
  const glm::dmat3 linear(worldFromMesh);
  const double determinant = glm::determinant(linear);
  const glm::dmat3 ofNormals = determinant != 0.0 ? glm::transpose(glm::inverse(linear)) : glm::dmat3(0.0);
  const size_t first = mesh.positions.size();
  if (first + from.mNumVertices > 0xfffffffeu) throw InputError("expected at most 2^32 - 2 vertices, found more");
  for (unsigned i = 0; i < from.mNumVertices; ++i) {
    mesh.positions.push_back(glm::vec3(worldFromMesh * glm::dvec4(glm::dvec3(fromAssimp(from.mVertices[i])), 1.0)));
    glm::vec3 normal(0.0f);
    if (from.HasNormals()) normal = glm::vec3(ofNormals * glm::dvec3(fromAssimp(from.mNormals[i])));
    mesh.normals.push_back(normal);
  }
  for (unsigned i = 0; i < from.mNumFaces; ++i) {
    const aiFace& face = from.mFaces[i];
    if (face.mNumIndices != 3) {
      ++raw.report.linesAndPoints;
      continue;
    }
    glm::uvec3 triangle;
    for (unsigned corner = 0; corner < 3; ++corner) {
      // A number beyond its own mesh must not reach into the next.
      const unsigned index = face.mIndices[corner];
      triangle[int(corner)] = index < from.mNumVertices ? uint32_t(first) + index : 0xffffffffu;
    }
    if (determinant < 0.0) std::swap(triangle.y, triangle.z);
    mesh.triangles.push_back(triangle);
    mesh.materialOfTriangle.push_back(from.mMaterialIndex);
  }
  raw.report.fileVertices += from.mNumVertices;
}

void addNodes(const aiScene& scene, RawMesh& raw) {
  struct Placed {
    const aiNode* node;
    glm::dmat4 worldFromParent;
  };
  std::vector<Placed> open{{scene.mRootNode, glm::dmat4(1.0)}};
  while (!open.empty()) {
    const Placed placed = open.back();
    open.pop_back();
    const glm::dmat4 worldFromNode = placed.worldFromParent * fromAssimp(placed.node->mTransformation);
    for (unsigned i = 0; i < placed.node->mNumMeshes; ++i)
      addMesh(*scene.mMeshes[placed.node->mMeshes[i]], worldFromNode, raw);
    for (unsigned i = placed.node->mNumChildren; i-- > 0;)
      open.push_back({placed.node->mChildren[i], worldFromNode});
  }
}

const char* nameOf(AssimpFormat format) {
  return format == AssimpFormat::obj ? "OBJ" : format == AssimpFormat::stl ? "STL" : "glTF";
}

std::string extensionOf(AssimpFormat format) {
  return format == AssimpFormat::obj ? "obj" : format == AssimpFormat::stl ? "stl" : "gltf";
}

}  // namespace

RawMesh readWithAssimp(const std::string& path, AssimpFormat format) {
  std::vector<std::byte> bytes = readWholeFile(path, kLargestFile);
  RawMesh raw;
  raw.report.format = nameOf(format);
  uint64_t counted = 0;
  if (format == AssimpFormat::obj) counted = checkObj(asText(bytes), path);
  if (format == AssimpFormat::stl) checkStl(asText(bytes), path);
  if (format == AssimpFormat::gltf) checkGltf(asText(bytes), path);

  const std::string name = withoutGz(path);
  Assimp::Importer importer;
  keepOnly(importer, extensionOf(format));
  MeshFiles* files = new MeshFiles(name, std::move(bytes));
  importer.SetIOHandler(files);  // owns it
  const aiScene* scene = importer.ReadFile(name, aiProcess_Triangulate);
  if (scene == nullptr) throw InputError(fmt::format("{}: {}", path, importer.GetErrorString()));

  const std::string folder = fs::path(path).parent_path().string();
  if (scene->mRootNode != nullptr) addNodes(*scene, raw);
  for (unsigned i = 0; i < scene->mNumMaterials; ++i)
    raw.mesh.materials.push_back(materialOf(*scene, *scene->mMaterials[i], format, folder, raw.report.notes));
  if (raw.mesh.materials.empty()) raw.mesh.materials.emplace_back();
  for (const uint32_t material : raw.mesh.materialOfTriangle) {
    if (material < raw.mesh.materials.size()) continue;
    throw InputError(
        fmt::format("{}: expected materials from 0 to below {}, found {}", path, raw.mesh.materials.size(), material));
  }
  for (const std::string& missing : files->missing()) {
    raw.report.notes.push_back(fmt::format("{} is missing: what it describes is left out", missing));
  }
  if (counted != 0) raw.report.fileVertices = counted;
  raw.report.fileTriangles = raw.mesh.triangles.size();
  const bool anyNormal = std::any_of(raw.mesh.normals.begin(), raw.mesh.normals.end(),
                                     [](glm::vec3 normal) { return normal != glm::vec3(0.0f); });
  // Assimp copies the facet's normal to the corners of STL.
  if (!anyNormal || format == AssimpFormat::stl) raw.mesh.normals.clear();
  return raw;
}

}  // namespace freevoxel
