#include "voxlink/read_mesh.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>

#include "base/error.h"
#include "volume/child_answer.h"
#include "volume/child_process.h"
#include "volume/text_parsing.h"
#include "volume/whole_file.h"
#include "voxlink/ply.h"
#include "voxlink/raw_mesh.h"
#include "voxlink/read_assimp.h"

namespace freevoxel {

namespace {

/// A mesh's header as it travels from the child; then come, as values: positions, normals, triangles, materials of
/// triangles, and a text with materials and notes.
struct MeshHeaderMessage {
  uint64_t positions = 0, normals = 0, triangles = 0, textBytes = 0;
  uint64_t fileVertices = 0, fileTriangles = 0, linesAndPoints = 0;
};
static_assert(sizeof(MeshHeaderMessage) == 56);

std::string extensionOf(const std::string& path) {
  std::filesystem::path name(path);
  if (lowerCase(name.extension().string()) == ".gz") name = name.stem();
  return lowerCase(name.extension().string());
}

std::optional<AssimpFormat> assimpFormat(const std::string& path) {
  const std::string extension = extensionOf(path);
  if (extension == ".obj") return AssimpFormat::obj;
  if (extension == ".stl") return AssimpFormat::stl;
  if (extension == ".gltf" || extension == ".glb") return AssimpFormat::gltf;
  return std::nullopt;
}

const char* nameOf(AssimpFormat format) {
  return format == AssimpFormat::obj ? "OBJ" : format == AssimpFormat::stl ? "STL" : "glTF";
}

std::string textOf(const RawMesh& raw) {
  RequestWriter text;
  text.add(uint64_t(raw.mesh.materials.size()));
  for (const Material& material : raw.mesh.materials) {
    text.addText(material.name);
    text.add(uint32_t(material.kind));
    for (int c = 0; c < 3; ++c)
      text.add(material.linear[c]);
    text.add(material.opacity);
  }
  text.addText(raw.report.format);
  for (const std::string& note : raw.report.notes)
    text.addText(note);
  return text.take();
}

void takeText(const std::string& bytes, RawMesh& raw) {
  RequestReader text(bytes);
  const auto materials = text.take<uint64_t>();
  for (uint64_t i = 0; i < materials; ++i) {
    Material material;
    material.name = text.takeText();
    material.kind =
        text.take<uint32_t>() == uint32_t(MaterialKind::glass) ? MaterialKind::glass : MaterialKind::diffuse;
    for (int c = 0; c < 3; ++c)
      material.linear[c] = text.take<float>();
    material.opacity = text.take<float>();
    raw.mesh.materials.push_back(std::move(material));
  }
  raw.report.format = text.takeText();
  while (!text.done())
    raw.report.notes.push_back(text.takeText());
}

template <class T>
void sendArray(AnswerWriter& answer, std::span<const T> values) {
  if (!values.empty()) answer.send(ChildMessage::values, std::as_bytes(values));
}

/// `count` values in one message. Memory grows with what comes.
template <class Array>
void receiveArray(ChildProcess& child, uint64_t count, Array& values) {
  using T = typename Array::value_type;
  if (count == 0) return;
  const MessageStart start = child.receiveStart();
  if (ChildMessage(start.kind) != ChildMessage::values || start.size / sizeof(T) != count ||
      start.size % sizeof(T) != 0) {
    child.failNonsense();
  }
  constexpr uint64_t kPortion = uint64_t(1) << 20;
  while (values.size() < count) {
    const size_t before = values.size();
    values.resize(before + std::min(kPortion, count - before));
    child.receive(std::as_writable_bytes(std::span(values.data() + before, values.size() - before)));
  }
}

RawMesh receiveMesh(ChildProcess& child) {
  MeshHeaderMessage header;
  const MessageStart start = child.receiveStart();
  if (ChildMessage(start.kind) != ChildMessage::header || start.size != sizeof header) child.failNonsense();
  child.receive(std::as_writable_bytes(std::span(&header, 1)));
  RawMesh raw;
  receiveArray(child, header.positions, raw.mesh.positions);
  receiveArray(child, header.normals, raw.mesh.normals);
  receiveArray(child, header.triangles, raw.mesh.triangles);
  receiveArray(child, header.triangles, raw.mesh.materialOfTriangle);
  std::string text;
  receiveArray(child, header.textBytes, text);
  if (ChildMessage(child.receiveStart().kind) != ChildMessage::end) child.failNonsense();
  try {
    takeText(text, raw);
  } catch (const InternalError&) {
    child.failNonsense();
  }
  const bool fits = (raw.mesh.normals.empty() || raw.mesh.normals.size() == raw.mesh.positions.size()) &&
                    std::all_of(raw.mesh.materialOfTriangle.begin(), raw.mesh.materialOfTriangle.end(),
                                [&](uint32_t material) { return material < raw.mesh.materials.size(); });
  if (!fits) child.failNonsense();
  raw.report.fileVertices = header.fileVertices;
  raw.report.fileTriangles = header.fileTriangles;
  raw.report.linesAndPoints = header.linesAndPoints;
  return raw;
}

RawMesh readInChild(const std::string& path, AssimpFormat format) {
  RequestWriter request;
  request.add(uint32_t(format));
  ChildProcess child({kMeshReaderArgument, nameOf(format), path, {path}, request.take()}, childProgram());
  return receiveMesh(child);
}

}  // namespace

bool isMeshFile(const std::string& path) {
  return extensionOf(path) == ".ply" || assimpFormat(path).has_value();
}

const char* meshFormatNames() {
  return "PLY, OBJ, STL, glTF";
}

MeshFile readMesh(const std::string& path) {
  constexpr size_t kLargestPly = size_t(1) << 36;
  if (extensionOf(path) == ".ply") {
    const std::vector<std::byte> bytes = readWholeFile(path, kLargestPly);
    return tidied(readPly(asText(bytes), path), false, path);
  }
  const std::optional<AssimpFormat> format = assimpFormat(path);
  if (!format)
    throw InputError(fmt::format("{}: expected a mesh ({}), by the end of its name", path, meshFormatNames()));
  return tidied(readInChild(path, *format), *format != AssimpFormat::gltf, path);
}

void runMeshReader() {
  answerRequest([](const std::string& path, RequestReader& request, AnswerWriter& answer) {
    const RawMesh raw = readWithAssimp(path, AssimpFormat(request.take<uint32_t>()));
    const std::string text = textOf(raw);
    const Mesh& mesh = raw.mesh;
    const MeshHeaderMessage header{
        mesh.positions.size(),   mesh.normals.size(),      mesh.triangles.size(),    text.size(),
        raw.report.fileVertices, raw.report.fileTriangles, raw.report.linesAndPoints};
    answer.send(ChildMessage::header, std::as_bytes(std::span(&header, 1)));
    sendArray<glm::vec3>(answer, mesh.positions);
    sendArray<glm::vec3>(answer, mesh.normals);
    sendArray<glm::uvec3>(answer, mesh.triangles);
    sendArray<uint32_t>(answer, mesh.materialOfTriangle);
    sendArray<char>(answer, text);
  });
}

}  // namespace freevoxel
