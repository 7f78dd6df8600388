#include "app/options.h"

#include <fmt/core.h>

#include <numbers>

#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

CameraOptions::OrbitDegrees parseOrbit(std::string_view text) {
  CameraOptions::OrbitDegrees orbit;
  try {
    if (std::count(text.begin(), text.end(), ',') == 1) {
      const glm::dvec3 angles = parseTriple(std::string(text) + ",0");
      orbit.azimuth = angles.x;
      orbit.elevation = angles.y;
    } else {
      const glm::dvec3 values = parseTriple(text);
      orbit.azimuth = values.x;
      orbit.elevation = values.y;
      orbit.distance = values.z;
    }
  } catch (const UsageError&) {
    throw UsageError(fmt::format("expected AZIMUTH,ELEVATION or AZIMUTH,ELEVATION,DISTANCE, found '{}'", text));
  }
  if (std::abs(orbit.elevation) > 90.0) {
    throw UsageError(fmt::format("expected an elevation from -90 to 90 degrees, found {}", orbit.elevation));
  }
  if (orbit.distance && *orbit.distance <= 0.0) {
    throw UsageError(fmt::format("expected a distance above 0, found {}", *orbit.distance));
  }
  return orbit;
}

double parseFov(std::string_view text) {
  const double degrees = parseNumber(text);
  if (!(degrees > 0.0 && degrees < 180.0)) {
    throw UsageError(fmt::format("expected degrees above 0 and below 180, found {}", text));
  }
  return degrees;
}

double parseHeight(std::string_view text) {
  const double height = parseNumber(text);
  if (height < 0.0) throw UsageError(fmt::format("expected a length, 0 or more, found {}", text));
  return height;
}

}  // namespace

void addCommonOptions(CLI::App& command, CommonOptions& options) {
  constexpr int kMaxThreads = 1024;
  addParsed<std::optional<int>>(
      command, "--threads", options.threads, "N",
      fmt::format("threads, 1 to {}; no result depends on it (default: every core)", kMaxThreads),
      [](std::string_view text) { return int(parseWhole(text, 1, kMaxThreads)); })
      ->group("Common");
  command.add_flag("--quiet", options.quiet, "no progress and no warnings")->group("Common");
  command.add_option("--stats", options.statisticsPath, "write what was done, and how fast, as JSON")
      ->type_name("FILE.json")
      ->group("Common");
}

void addVolumeOptions(CLI::App& command, VolumeOptions& options) {
  const std::string group = "Raw volumes (no header; gzip is undone)";
  addParsed(command, "--dims", options.dims, "X,Y,Z", fmt::format("voxels along each axis, 1 to {}", kMaxDim),
            parseDims)
      ->group(group);
  std::string types;
  for (const ValueType type : {ValueType::u8, ValueType::i8, ValueType::u16, ValueType::i16, ValueType::u32,
                               ValueType::i32, ValueType::f32, ValueType::f64}) {
    types += fmt::format("{}{}", types.empty() ? "" : "|", valueTypeName(type));
  }
  const auto parseType = [types](std::string_view text) -> std::optional<ValueType> {
    for (const ValueType type : {ValueType::u8, ValueType::i8, ValueType::u16, ValueType::i16, ValueType::u32,
                                 ValueType::i32, ValueType::f32, ValueType::f64}) {
      if (valueTypeName(type) == text) return type;
    }
    throw UsageError(fmt::format("expected {}, found '{}'", types, text));
  };
  addParsed<std::optional<ValueType>>(command, "--type", options.type, "TYPE", "type of a value: " + types, parseType)
      ->group(group);
  addChoice<ByteOrder>(command, "--endian", options.byteOrder, {{"little", ByteOrder::little}, {"big", ByteOrder::big}},
                       "byte order of a value")
      ->group(group);
  addParsed<uint64_t>(command, "--skip", options.skip, "BYTES",
                      fmt::format("bytes before the first voxel, after decompression; K, M, G are understood "
                                  "(default {})",
                                  options.skip),
                      parseBytes)
      ->group(group);
  addParsed(command, "--spacing", options.spacing, "SX,SY,SZ",
            "lengths of a voxel's edges, each above 0; also replaces what a header says (default 1,1,1)", parseSpacing)
      ->group(group);
  const std::string several = "Volumes that hold more than one value per voxel, or names";
  addParsed<std::optional<std::string>>(
      command, "--component", options.component, "NAME|N",
      "which value of each voxel: an array of a .vtk file, a grid of a .vdb file, a channel; a name or a number from 0",
      [](std::string_view text) { return std::optional<std::string>(text); })
      ->group(several);
  addParsed<std::optional<int>>(
      command, "--frame", options.frame, "N",
      "which volume of a series: from 0 in one file, or the number in a pattern such as frame_%04d.nrrd",
      [](std::string_view text) { return std::optional<int>(int(parseWhole(text, 0, kMaxDim))); })
      ->group(several);
  command
      .add_flag("--labels", options.labels,
                "values are names (tissue 3, organ 7): nothing is interpolated between two of them")
      ->group(several);
}

CLI::Option* addTransferOption(CLI::App& command, std::string& target, const std::string& note) {
  std::string presets;
  for (const TransferPreset& preset : transferPresets()) {
    presets += fmt::format("{}{}", presets.empty() ? "" : ", ", preset.name);
  }
  return command
      .add_option(
          "--transfer", target,
          fmt::format("transfer function: a file (.json, also ParaView's; .1dt of ImageVis3D; .vp of 3D Slicer) "
                      "or a name: {}{}",
                      presets, note))
      ->type_name("FILE|NAME");
}

bool hasVolumeOptions(const VolumeOptions& options) {
  const VolumeOptions none;
  return options.dims || options.type || options.spacing || options.byteOrder != none.byteOrder ||
         options.skip != none.skip || options.component || options.frame || options.labels;
}

void addCameraOptions(CLI::App& command, CameraOptions& options) {
  const std::string group = "Camera (world space: right-handed, y up, the volume's length unit)";
  const CameraOptions::OrbitDegrees orbit;
  CLI::Option* orbitOption =
      addParsed(command, "--orbit", options.orbit, "AZ,EL[,DIST]",
                fmt::format("look at the volume's centre from azimuth and elevation in degrees (elevation -90 to 90; "
                            "0,0 looks along -z) and a distance above 0 (default {},{}, framed to fit)",
                            orbit.azimuth, orbit.elevation),
                parseOrbit)
          ->group(group);
  CLI::Option* eye = addParsed(command, "--eye", options.eye, "X,Y,Z", "the camera's place", parseTriple)->group(group);
  eye->excludes(orbitOption);
  addParsed(command, "--target", options.target, "X,Y,Z", "the point it looks at (default: the volume's centre)",
            parseTriple)
      ->group(group)
      ->needs(eye);
  addParsed(command, "--up", options.up, "X,Y,Z", "what is up in the picture (default 0,1,0)", parseTriple)
      ->group(group)
      ->needs(eye);
  CLI::Option* fov =
      addParsed<double>(command, "--fov", options.fovDegrees, "DEGREES",
                        fmt::format("vertical field of view, above 0 and below 180 (default {})", options.fovDegrees),
                        parseFov)
          ->group(group);
  addParsed(command, "--orthographic", options.orthographicHeight, "HEIGHT",
            "parallel rays; the length that the picture's height shows, or 0 to frame the volume (not with --eye)",
            parseHeight)
      ->group(group)
      ->excludes(fov);
  addParsed<glm::ivec2>(command, "--size", options.imageSize, "WxH",
                        fmt::format("picture size in pixels, each from 1 to 32768 (default {}x{})", options.imageSize.x,
                                    options.imageSize.y),
                        parseImageSize)
      ->group(group);
}

Camera makeCamera(const CameraOptions& options, const Box& box) {
  Camera camera;
  if (!options.eye) {
    const CameraOptions::OrbitDegrees degrees = options.orbit.value_or(CameraOptions::OrbitDegrees{});
    const Orbit orbit{degrees.azimuth * kRadians, degrees.elevation * kRadians, degrees.distance};
    camera = orbitCamera(box, orbit, options.imageSize, options.fovDegrees * kRadians, options.orthographicHeight);
  } else {
    if (options.orthographicHeight && *options.orthographicHeight == 0.0) {
      throw UsageError("--orthographic 0 frames the volume and cannot go with --eye; give a height above 0");
    }
    camera.eye = *options.eye;
    camera.target = options.target.value_or(box.centre());
    if (options.up) camera.up = *options.up;
    camera.verticalFov = options.fovDegrees * kRadians;
    camera.orthographicHeight = options.orthographicHeight;
    camera.imageSize = options.imageSize;
  }
  checkCamera(camera);
  return camera;
}

}  // namespace freevoxel
