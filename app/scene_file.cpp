#include "app/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "app/input_file.h"
#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/json_reading.h"
#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

constexpr double kLargestPlace = 1e12;
constexpr double kBrightest = 1000.0;

std::string besideScene(const std::string& scene, const std::string& name) {
  const std::filesystem::path path(name);
  return path.is_absolute() ? name : (std::filesystem::path(scene).parent_path() / path).string();
}

template <class T>
T oneOf(const JsonPlace& place, std::initializer_list<std::pair<const char*, T>> choices) {
  const std::string found = place.text();
  std::string words;
  for (const auto& [word, value] : choices) {
    if (found == word) return value;
    words += fmt::format("{}{}", words.empty() ? "" : ", ", word);
  }
  place.fail(fmt::format("expected one of {}, found '{}'", words, found));
}

ValueType readType(const JsonPlace& place) {
  return oneOf<ValueType>(place, {{"u8", ValueType::u8},
                                  {"i8", ValueType::i8},
                                  {"u16", ValueType::u16},
                                  {"i16", ValueType::i16},
                                  {"u32", ValueType::u32},
                                  {"i32", ValueType::i32},
                                  {"f32", ValueType::f32},
                                  {"f64", ValueType::f64}});
}

VolumeOptions readRaw(const JsonPlace& volume) {
  VolumeOptions raw;
  if (volume.has("dims")) {
    const JsonPlace dims = volume.member("dims");
    dims.size(3, 3, "[x, y, z]");
    raw.dims.emplace();
    for (int axis = 0; axis < 3; ++axis)
      (*raw.dims)[axis] = int(dims.element(size_t(axis)).whole(1, kMaxDim));
  }
  if (volume.has("type")) raw.type = readType(volume.member("type"));
  if (volume.has("endian")) {
    raw.byteOrder = oneOf<ByteOrder>(volume.member("endian"), {{"little", ByteOrder::little}, {"big", ByteOrder::big}});
  }
  if (volume.has("skip")) raw.skip = uint64_t(volume.member("skip").whole(0, int64_t(1) << 50));
  if (volume.has("spacing")) raw.spacing = volume.member("spacing").triple(1e-30, 1e30, "[sx, sy, sz]");
  if (volume.has("component")) raw.component = volume.member("component").text();
  if (volume.has("frame")) raw.frame = int(volume.member("frame").whole(0, kMaxDim));
  if (volume.has("labels")) raw.labels = volume.member("labels").flag();
  return raw;
}

void readView(const JsonPlace& camera, CameraOptions& options) {
  if (camera.has("orbit")) {
    if (camera.has("eye")) camera.fail("expected either 'orbit' or 'eye', found both");
    const JsonPlace orbit = camera.member("orbit");
    orbit.size(2, 3, "[azimuth, elevation] or [azimuth, elevation, distance]");
    options.orbit = CameraOptions::OrbitDegrees();
    options.orbit->azimuth = orbit.element(0).number(-1e6, 1e6);
    options.orbit->elevation = orbit.element(1).number(-90.0, 90.0);
    if (orbit.size() == 3) options.orbit->distance = orbit.element(2).number(1e-30, kLargestPlace);
  }
  const auto place = [&](const char* key, std::optional<glm::dvec3>& target) {
    if (camera.has(key)) target = camera.member(key).triple(-kLargestPlace, kLargestPlace, "[x, y, z]");
  };
  place("eye", options.eye);
  place("target", options.target);
  place("up", options.up);
  if (!options.eye && (options.target || options.up))
    camera.fail("expected a key 'eye' with 'target' or 'up', found none");
}

Light readLight(const JsonPlace& place) {
  place.onlyKeys({"position", "direction", "color"});
  if (place.has("position") == place.has("direction")) place.fail("expected either 'position' or 'direction'");
  Light light;
  light.directional = place.has("direction");
  const JsonPlace where = place.member(light.directional ? "direction" : "position");
  light.world = where.triple(-kLargestPlace, kLargestPlace, "[x, y, z]");
  if (light.directional && light.world == glm::dvec3(0.0)) where.fail("expected a direction, found 0,0,0");
  if (place.has("color")) light.linear = glm::vec3(place.member("color").triple(0.0, kBrightest, "[red, green, blue]"));
  return light;
}

}  // namespace

bool isSceneFile(const std::string& path) {
  return lowerCaseExtension(path) == "json";
}

void useScene(const CLI::App& command, const SceneOptions& options) {
  const auto given = [&](std::initializer_list<const char*> names) {
    return std::any_of(names.begin(), names.end(),
                       [&](const char* name) { return command.get_option(name)->count() > 0; });
  };
  const std::string path = options.input;
  const MappedFile file(path);
  constexpr size_t kLargestFile = size_t(1) << 24;
  if (file.bytes().size() > kLargestFile) {
    throw InputError(
        fmt::format("{}: expected a scene of at most {} bytes, found {}", path, kLargestFile, file.bytes().size()));
  }
  const std::string text(reinterpret_cast<const char*>(file.bytes().data()), file.bytes().size());
  const nlohmann::json document = parseJson(text, path);
  const JsonPlace scene(document, path, jsonLines(text));
  scene.onlyKeys({"volume", "transfer", "camera", "image", "lights", "ambient", "shading"});

  const JsonPlace volume = scene.member("volume");
  volume.onlyKeys({"file", "dims", "type", "endian", "skip", "spacing", "component", "frame", "labels"});
  options.input = besideScene(path, volume.member("file").text());
  const VolumeOptions raw = readRaw(volume);
  if (!hasVolumeOptions(options.raw)) options.raw = raw;

  if (scene.has("transfer")) {
    std::string transfer = scene.member("transfer").text();
    const std::vector<TransferPreset>& presets = transferPresets();
    if (std::none_of(presets.begin(), presets.end(), [&](const TransferPreset& p) { return p.name == transfer; })) {
      transfer = besideScene(path, transfer);
    }
    if (options.transfer.empty()) options.transfer = transfer;
  }

  if (scene.has("camera")) {
    const JsonPlace camera = scene.member("camera");
    camera.onlyKeys({"orbit", "eye", "target", "up", "fov", "orthographic"});
    CameraOptions view;
    readView(camera, view);
    if (!given({"--orbit", "--eye", "--target", "--up"})) {
      options.camera.orbit = view.orbit;
      options.camera.eye = view.eye;
      options.camera.target = view.target;
      options.camera.up = view.up;
    }
    if (camera.has("fov") && camera.has("orthographic")) {
      camera.fail("expected either 'fov' or 'orthographic', found both");
    }
    if (camera.has("fov")) {
      const double fov = camera.member("fov").number(1e-6, 179.999);
      if (!given({"--fov", "--orthographic"})) options.camera.fovDegrees = fov;
    }
    if (camera.has("orthographic")) {
      const double height = camera.member("orthographic").number(0.0, kLargestPlace);
      if (!given({"--fov", "--orthographic"})) options.camera.orthographicHeight = height;
    }
  }

  if (scene.has("image")) {
    const JsonPlace image = scene.member("image");
    image.onlyKeys({"size", "background"});
    if (image.has("size")) {
      const JsonPlace size = image.member("size");
      size.size(2, 2, "[width, height]");
      const glm::ivec2 pixels(int(size.element(0).whole(1, 32768)), int(size.element(1).whole(1, 32768)));
      if (!given({"--size"})) options.camera.imageSize = pixels;
    }
    if (image.has("background")) {
      const JsonPlace background = image.member("background");
      try {
        const Background parsed = parseBackground(background.text());
        if (!given({"--background"})) options.picture.background = parsed;
      } catch (const UsageError& error) {
        background.fail(error.what());
      }
    }
  }

  if (scene.has("lights")) {
    const JsonPlace lights = scene.member("lights");
    lights.size(0, 100000, "a list of lights");
    std::vector<Light> lamps;
    for (size_t i = 0; i < lights.size(); ++i)
      lamps.push_back(readLight(lights.element(i)));
    if (options.light.lights.empty()) options.light.lights = lamps;
  }
  if (scene.has("ambient")) {
    const double ambient = scene.member("ambient").number(0.0, kBrightest);
    if (!given({"--ambient"})) options.light.ambient = ambient;
  }
  if (scene.has("shading")) {
    const Shading shading = oneOf<Shading>(
        scene.member("shading"), {{"none", Shading::none}, {"lambert", Shading::lambert}, {"phong", Shading::phong}});
    if (!given({"--shading"})) options.light.shading = shading;
  }
}

}  // namespace freevoxel
