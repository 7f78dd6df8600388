// freevoxel info: what is in a file.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <memory>
#include <numeric>

#include "app/command.h"
#include "app/input_file.h"
#include "base/error.h"
#include "hierarchy/attenuation_file.h"
#include "volume/read_volume.h"
#include "voxlink/read_mesh.h"
#include "voxlink/read_spheres.h"

namespace freevoxel {

namespace {

struct InfoOptions {
  std::string input;
  VolumeOptions raw;
  bool json = false;
};

/// How many values lie in each of equal parts of a range, its ends included.
struct Histogram {
  double low = 0.0, high = 0.0;
  std::array<uint64_t, 16> counts{};

  void add(double value) {
    const double place = high > low ? (value - low) / (high - low) * double(counts.size()) : 0.0;
    ++counts[std::min(size_t(std::max(place, 0.0)), counts.size() - 1)];
  }
};

nlohmann::ordered_json triple(glm::dvec3 v) {
  return {v.x, v.y, v.z};
}

nlohmann::ordered_json header(glm::ivec3 dims, const Placement& placement, std::string_view type, double low,
                              double high) {
  const Box box = worldBounds(placement, dims);
  return {
      {"dims", {dims.x, dims.y, dims.z}},
      {"spacing", triple(placement.spacing)},
      {"origin", triple(placement.origin)},
      {"direction", {triple(placement.direction[0]), triple(placement.direction[1]), triple(placement.direction[2])}},
      {"bounds", {triple(box.lower), triple(box.upper)}},
      {"type", type},
      {"range", {low, high}}};
}

nlohmann::ordered_json describe(const Volume& volume, const std::string& path, Histogram& histogram) {
  const ValueStatistics figures = valueStatistics(volume);
  histogram.low = figures.low;
  histogram.high = figures.high;
  for (uint64_t i = 0; i < volume.header.voxels(); ++i) {
    if (const double value = volume.value(i); std::isfinite(value)) histogram.add(value);
  }
  nlohmann::ordered_json json =
      header(volume.header.dims, volume.header.placement, valueTypeName(volume.header.type), figures.low, figures.high);
  json["sum"] = figures.sum;
  json["nonFinite"] = figures.nonFinite;
  json["fileBytes"] = fileBytes(path);
  return json;
}

nlohmann::ordered_json describe(const AttenuationFile& file, Histogram& histogram) {
  const ValueCoding& coding = file.coding();
  histogram.low = coding.low;
  histogram.high = coding.decode(coding.largest);
  double sum = 0.0;
  for (size_t i = 0; i < file.brickCount(); ++i) {
    const BrickView brick = file.brick(i, DirectionSet(0));
    for (size_t step = 0; step < brick.curve.size(); ++step) {
      const glm::ivec3 voxel = brick.origin + glm::ivec3(brick.curve[step].x, brick.curve[step].y, brick.curve[step].z);
      if (voxel.x >= file.dims().x || voxel.y >= file.dims().y || voxel.z >= file.dims().z) continue;
      const double value = coding.decode(brick.code(step));
      sum += value;
      histogram.add(value);
    }
    file.checkIntact();
  }
  nlohmann::ordered_json json =
      header(file.dims(), file.placement(), coding.bytes() == 1 ? "u8" : "u16", histogram.low, histogram.high);
  json["sum"] = sum;
  json["nonFinite"] = file.nonFinite();
  json["fileBytes"] = file.fileBytes();
  json["layout"] = layoutName(file.layout());
  json["classification"] = classificationName(file.classification());
  json["levels"] = file.levels();
  json["hierarchy"] = hierarchyName(file.hierarchy());
  json["bricks"] = file.brickCount();
  json["pins"] = nlohmann::ordered_json::array();
  for (const Pin& pin : file.pinned().pins())
    json["pins"].push_back({{pin.directional ? "direction" : "position", triple(pin.world)}});
  json["pinBytes"] = file.pinned().bytes();
  json["storedVoxels"] = file.storedVoxels();
  const auto per = [](uint64_t bytes, uint64_t voxels) { return voxels > 0 ? double(bytes) / double(voxels) : 0.0; };
  const uint64_t voxels = voxelCount(file.dims());
  json["occupancy"] = double(file.storedVoxels()) / double(voxels);
  json["valueBytes"] = file.codeBytes();
  json["attenuationBytes"] = file.attenuationBytes();
  json["levelBytes"] = file.levelBytes();
  json["valueBytesPerVoxel"] = per(file.codeBytes(), voxels);
  json["attenuationBytesPerVoxel"] = per(file.attenuationBytes(), voxels);
  json["levelBytesPerVoxel"] = per(file.levelBytes(), voxels);
  json["pinBytesPerVoxel"] = per(file.pinned().bytes(), voxels);
  json["valueBytesPerStoredVoxel"] = per(file.codeBytes(), file.storedVoxels());
  json["attenuationBytesPerStoredVoxel"] = per(file.attenuationBytes(), file.storedVoxels());
  return json;
}

void printHistogram(const Histogram& histogram) {
  const uint64_t total = std::accumulate(histogram.counts.begin(), histogram.counts.end(), uint64_t(0));
  const uint64_t largest = *std::max_element(histogram.counts.begin(), histogram.counts.end());
  if (largest == 0) return;
  fmt::print("values, bars logarithmic:\n");
  const double width = (histogram.high - histogram.low) / double(histogram.counts.size());
  for (size_t i = 0; i < histogram.counts.size(); ++i) {
    constexpr double kLongest = 50.0;
    const double length = kLongest * std::log1p(double(histogram.counts[i])) / std::log1p(double(largest));
    fmt::print("{:>12.6g}  {:>6.2f} %  {}\n", histogram.low + width * double(i),
               100.0 * double(histogram.counts[i]) / double(total), std::string(size_t(std::lround(length)), '#'));
  }
}

nlohmann::ordered_json bounds(const std::vector<glm::vec3>& places, float reach) {
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (const glm::vec3 place : places) {
    low = glm::min(low, place - reach);
    high = glm::max(high, place + reach);
  }
  return {triple(low), triple(high)};
}

const char* kindName(MaterialKind kind) {
  return kind == MaterialKind::glass ? "glass" : kind == MaterialKind::mirror ? "mirror" : "diffuse";
}

nlohmann::ordered_json describe(const std::vector<Material>& materials, const std::vector<uint32_t>& users) {
  std::vector<uint64_t> counts(materials.size(), 0);
  for (const uint32_t user : users)
    ++counts[user];
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  constexpr size_t kMostShown = 64;
  for (size_t i = 0; i < std::min(materials.size(), kMostShown); ++i) {
    const Material& material = materials[i];
    list.push_back({{"name", material.name},
                    {"kind", kindName(material.kind)},
                    {"linear", triple(material.linear)},
                    {"opacity", material.opacity},
                    {"used", counts[i]}});
  }
  return list;
}

nlohmann::ordered_json describe(const MeshFile& file) {
  const MeshReport& report = file.report;
  return {{"format", report.format},
          {"vertices", report.fileVertices},
          {"triangles", report.fileTriangles},
          {"bounds", bounds(file.mesh.positions, 0.0f)},
          {"normals", !file.mesh.normals.empty()},
          {"nonFiniteVertices", report.nonFiniteVertices},
          {"nonFiniteTriangles", report.nonFiniteTriangles},
          {"degenerateTriangles", report.degenerateTriangles},
          {"linesAndPoints", report.linesAndPoints},
          {"materialCount", file.mesh.materials.size()},
          {"materials", describe(file.mesh.materials, file.mesh.materialOfTriangle)},
          {"notes", report.notes}};
}

nlohmann::ordered_json describe(const SphereFile& file) {
  const SphereReport& report = file.report;
  const auto [least, most] = std::minmax_element(file.spheres.radii.begin(), file.spheres.radii.end());
  return {{"format", report.format},
          {"spheres", file.spheres.centres.size()},
          {"inFile", report.fileSpheres},
          {"copies", report.copies},
          {"bounds", bounds(file.spheres.centres, *most)},
          {"radii", {*least, *most}},
          {"nonFinite", report.nonFinite},
          {"withoutRadius", report.withoutRadius},
          {"materialCount", file.spheres.materials.size()},
          {"materials", describe(file.spheres.materials, file.spheres.materialOfSphere)},
          {"notes", report.notes}};
}

Outcome info(const InfoOptions& options, Session& session) {
  Histogram histogram;
  nlohmann::ordered_json json;
  std::string remarks;
  if (isAttenuationFile(options.input)) {
    if (hasVolumeOptions(options.raw)) throw UsageError("options for raw volumes make no sense for an .fvx file");
    const AttenuationFile file(options.input);
    json = session.timed("read", [&] { return describe(file, histogram); });
    const uint64_t voxels = voxelCount(file.dims());
    session.statistics["voxels"] = voxels;
    session.statistics["storedVoxels"] = file.storedVoxels();
    session.statistics["bytesPerVoxel"] = double(file.fileBytes()) / double(voxels);
    remarks = fmt::format(
        "attenuation file: {} voxels, {:.1f} % stored, {} visible\n"
        "bytes per voxel of the volume: {:.3g}, of which values {:.3g}, attenuation {:.3g}, coarser levels {:.3g}, "
        "pins {:.3g}; per stored voxel: values {:.3g}, attenuation {:.3g}\n"
        "made by: {}\nsum and values: of stored voxels, as coded\n",
        voxels, 100.0 * double(file.storedVoxels()) / double(voxels), file.visibleVoxels(),
        double(file.fileBytes()) / double(voxels), json["valueBytesPerVoxel"].get<double>(),
        json["attenuationBytesPerVoxel"].get<double>(), json["levelBytesPerVoxel"].get<double>(),
        json["pinBytesPerVoxel"].get<double>(), json["valueBytesPerStoredVoxel"].get<double>(),
        json["attenuationBytesPerStoredVoxel"].get<double>(), file.command());
  } else if (isMeshFile(options.input) || (isSphereFile(options.input) && !isVolumeArray(options.input))) {
    if (hasVolumeOptions(options.raw)) throw UsageError("options for raw volumes make no sense for meshes and spheres");
    json = session.timed("read", [&] {
      return isMeshFile(options.input) ? describe(readMesh(options.input)) : describe(readSpheres(options.input));
    });
    json["fileBytes"] = fileBytes(options.input);
  } else {
    const Volume volume = session.timed("read", [&] { return readVolume(options.input, options.raw); });
    json = session.timed("measure", [&] { return describe(volume, options.input, histogram); });
    session.statistics["voxels"] = volume.header.voxels();
    remarks = fmt::format("volume: {} voxels\n", volume.header.voxels());
  }
  session.statistics["fileBytes"] = json["fileBytes"];
  if (json.contains("nonFinite")) session.statistics["nonFinite"] = json["nonFinite"];
  if (options.json) {
    fmt::print("{}\n", json.dump(2));
    return Outcome::done;
  }
  fmt::print("{}", remarks);
  for (const auto& [key, value] : json.items()) {
    fmt::print("{:<30} {}\n", key, value.is_string() ? value.get<std::string>() : value.dump());
  }
  printHistogram(histogram);
  return Outcome::done;
}

}  // namespace

Command addInfo(CLI::App& program, CommonOptions& common) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* command =
      addSubcommand(program, "info", "tell what is in an attenuation file, a volume, or a file of meshes or spheres",
                    "freevoxel info head.raw.gz --dims 256,256,113 --type u16 --endian big");
  command->add_option("FILE", options->input, "an attenuation file, a volume, a mesh or spheres")->required();
  command->add_flag(
      "--json", options->json,
      "print JSON: dims, spacing, origin, direction (of each axis), bounds (world), type, range, sum, "
      "nonFinite, fileBytes; for an attenuation "
      "file also layout, classification, levels, hierarchy, bricks, pins (each a direction or a position, world), "
      "pinBytes, storedVoxels, occupancy (their share), "
      "valueBytes, attenuationBytes (both of the finest level), levelBytes (of all others), these and pinBytes per "
      "voxel "
      "of the volume (...PerVoxel) and the first two per stored voxel (...PerStoredVoxel) (there sum is over stored "
      "voxels); "
      "of meshes and spheres what is in them, what "
      "was left out, and the first 64 materials");
  addVolumeOptions(*command, options->raw);
  addCommonOptions(*command, common);
  return {command, [options](Session& session) { return info(*options, session); }};
}

}  // namespace freevoxel
