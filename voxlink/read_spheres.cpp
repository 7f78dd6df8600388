#include "voxlink/read_spheres.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>

#include "base/error.h"
#include "volume/text_parsing.h"
#include "voxlink/raw_spheres.h"

namespace freevoxel {

namespace {

struct Format {
  std::string_view extension;
  RawSpheres (*read)(const std::string& path, const SphereOptions& options);
};
constexpr std::array<Format, 5> kFormats{
    {{".csv", readCsv}, {".xyz", readXyz}, {".pdb", readPdb}, {".ent", readPdb}, {".npy", readNumpySpheres}}};

const Format* formatOf(const std::string& path) {
  std::filesystem::path name(path);
  if (lowerCase(name.extension().string()) == ".gz") name = name.stem();
  const std::string extension = lowerCase(name.extension().string());
  const auto found = std::find_if(kFormats.begin(), kFormats.end(),
                                  [&](const Format& format) { return format.extension == extension; });
  return found == kFormats.end() ? nullptr : found;
}

bool isFinite(glm::vec3 v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// For spheres whose file names none; 1 if all centres are in one place.
float usualRadius(const Spheres& spheres) {
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const glm::vec3 centre : spheres.centres) {
    if (!isFinite(centre)) continue;
    low = glm::min(low, glm::dvec3(centre));
    high = glm::max(high, glm::dvec3(centre));
  }
  constexpr double kShare = 1.0 / 200.0;
  const double longest = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 0.0});
  return longest > 0.0 ? float(kShare * longest) : 1.0f;
}

void leaveOut(Spheres& spheres, SphereReport& report) {
  size_t kept = 0;
  for (size_t i = 0; i < spheres.centres.size(); ++i) {
    if (!isFinite(spheres.centres[i]) || !std::isfinite(spheres.radii[i])) {
      ++report.nonFinite;
    } else if (spheres.radii[i] <= 0.0f) {
      ++report.withoutRadius;
    } else {
      spheres.centres[kept] = spheres.centres[i];
      spheres.radii[kept] = spheres.radii[i];
      spheres.materialOfSphere[kept++] = spheres.materialOfSphere[i];
    }
  }
  spheres.centres.resize(kept);
  spheres.radii.resize(kept);
  spheres.materialOfSphere.resize(kept);
}

}  // namespace

bool isSphereFile(const std::string& path) {
  return formatOf(path) != nullptr;
}

const char* sphereFormatNames() {
  return "CSV, XYZ, PDB, NPY";
}

SphereFile readSpheres(const std::string& path, const SphereOptions& options) {
  const Format* format = formatOf(path);
  if (format == nullptr) {
    throw InputError(fmt::format("{}: expected spheres ({}), by the end of its name", path, sphereFormatNames()));
  }
  RawSpheres file = format->read(path, options);
  Spheres& spheres = file.spheres;
  if (options.radius) {
    spheres.radii.assign(spheres.centres.size(), *options.radius);
  } else if (spheres.radii.empty() && !spheres.centres.empty()) {
    const float radius = usualRadius(spheres);
    spheres.radii.assign(spheres.centres.size(), radius);
    file.report.notes.push_back(fmt::format("no radii in the file: {:.4g} for all, a 200th of their box", radius));
  }
  leaveOut(spheres, file.report);
  if (spheres.centres.empty()) {
    throw InputError(
        fmt::format("{}: expected spheres, found none to see ({} in the file, {} of radius 0 or below, {} not finite)",
                    path, file.report.fileSpheres, file.report.withoutRadius, file.report.nonFinite));
  }
  return file;
}

}  // namespace freevoxel
