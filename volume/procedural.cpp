#include "volume/procedural.h"

#include <exception>

#include "base/error.h"
#include "volume/procedural_kinds.h"

namespace freevoxel {

namespace {

struct Entry {
  ProceduralKind kind;
  SliceGenerator (*generator)(glm::ivec3 dims, uint64_t seed);
};

const std::vector<Entry>& entries() {
  static const std::vector<Entry> list{
      {{"cube", "the value 128 everywhere", ValueType::u8}, cubeGenerator},
      {{"sphere",
        "a ball of value 255 (an ellipsoid in a box that is no cube), four fifths as wide as the box, in 0; "
        "its edge is one voxel soft",
        ValueType::u8},
       sphereGenerator},
      {{"ramp", "(4x + 2y + z) / 7 with x, y, z from 0 to 1 between the outermost voxels", ValueType::f32},
       rampGenerator},
      {{"marschner-lobb",
        "the test signal of Marschner and Lobb (1994), fM = 6, alpha = 0.25, -1 to 1 between the "
        "outermost voxels",
        ValueType::f32},
       marschnerLobbGenerator},
      {{"shepp-logan",
        "the head phantom of Shepp and Logan in 3D with Toft's contrast: skull 1000, brain 200, "
        "ventricles 0, tumours 300",
        ValueType::u16},
       sheppLoganGenerator},
      {{"cloud", "a cloud of fractal noise with soft edges in 0", ValueType::u8}, cloudGenerator},
      {{"checkered-cloud",
        "the cloud around 128: density above it in the even cells of a 6 x 6 x 6 checker, below it "
        "in the odd ones",
        ValueType::u8},
       checkeredCloudGenerator},
      {{"menger", "a Menger sponge of value 255 in 0, as deep as the voxels resolve (up to 6 levels)", ValueType::u8},
       mengerGenerator},
      {{"kronecker", "a random field of rank 48, mean 0, deviation 1; |value| > 0.95 fills about 34 % of it",
        ValueType::f32},
       kroneckerGenerator},
      {{"shells",
        "six nested thin shells of values 240, 200, .. 40 from the innermost out, in 0 (ellipsoids in a box "
        "that is no cube)",
        ValueType::u8},
       shellsGenerator},
  };
  return list;
}

const Entry& findEntry(const std::string& kind, glm::ivec3 dims) {
  if (!validDims(dims)) {
    throw InputError(
        fmt::format("generate {}: dims {} x {} x {} are not within 1..{}", kind, dims.x, dims.y, dims.z, kMaxDim));
  }
  std::string names;
  for (const Entry& entry : entries()) {
    if (entry.kind.name == kind) return entry;
    names += " " + entry.kind.name;
  }
  throw InputError(fmt::format("generate: unknown kind '{}', expected one of:{}", kind, names));
}

}  // namespace

const std::vector<ProceduralKind>& proceduralKinds() {
  static const std::vector<ProceduralKind> kinds = [] {
    std::vector<ProceduralKind> list;
    for (const Entry& entry : entries())
      list.push_back(entry.kind);
    return list;
  }();
  return kinds;
}

VolumeHeader proceduralHeader(const std::string& kind, glm::ivec3 dims) {
  const Entry& entry = findEntry(kind, dims);
  if (!checkedProduct(voxelCount(dims), bytesPerValue(entry.kind.type))) {
    throw InputError(
        fmt::format("generate {}: {} x {} x {} values are more than 2^64 bytes", kind, dims.x, dims.y, dims.z));
  }
  return {dims, entry.kind.type, Placement{}};
}

Volume generateVolume(const std::string& kind, glm::ivec3 dims, uint64_t seed) {
  Volume volume;
  volume.header = proceduralHeader(kind, dims);
  const uint64_t bytes = volume.header.bytes();
  try {
    volume.data.resize(bytes);
  } catch (const std::exception&) {  // bad_alloc or length_error
    throw MachineError(fmt::format("generate {}: no memory for {} bytes; ask for smaller dims", kind, bytes));
  }
  generateSlices(kind, dims, seed, 0, dims.z, volume.data);
  return volume;
}

void generateSlices(const std::string& kind, glm::ivec3 dims, uint64_t seed, int firstSlice, int count,
                    std::span<std::byte> out) {
  const VolumeHeader header = proceduralHeader(kind, dims);
  const uint64_t sliceBytes = header.bytes() / uint64_t(dims.z);
  check(firstSlice >= 0 && count >= 0 && count <= dims.z - firstSlice, "slices to generate lie in the volume");
  checkEqual(uint64_t(out.size()), uint64_t(count) * sliceBytes, "size of the room for slices");
  const SliceGenerator generate = findEntry(kind, dims).generator(dims, seed);
#pragma omp parallel for schedule(dynamic)
  for (int i = 0; i < count; ++i)
    generate(firstSlice + i, out.data() + uint64_t(i) * sliceBytes);
}

}  // namespace freevoxel
