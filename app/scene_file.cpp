#include "app/scene_file.h"

#include <fmt/core.h>

#include <algorithm>

#include "app/input_file.h"
#include "app/scene_reading.h"
#include "base/error.h"
#include "base/mapped_file.h"
#include "volume/json_reading.h"

namespace freevoxel {

namespace {

constexpr double kBrightest = 1000.0;

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

/// What the scene shows: one volume, or several objects.
void readObjects(const JsonPlace& scene, const SceneOptions& options) {
  const std::string path = options.input;
  std::string transfer;
  if (scene.has("transfer")) transfer = transferBesideScene(path, scene.member("transfer").text());
  if (options.transfer.empty()) options.transfer = transfer;
  SceneObjects objects = readSceneObjects(scene, path);
  std::optional<VolumeObject> single;
  if (scene.has("volume") || objects.empty()) {
    const JsonPlace volume = scene.member("volume");
    volume.onlyKeys({"file", "dims", "type", "endian", "skip", "spacing", "component", "frame", "labels"});
    single.emplace();
    single->file = besideScene(path, volume.member("file").text());
    single->raw = hasVolumeOptions(options.raw) ? options.raw : readRawOptions(volume);
  }
  if (objects.empty()) {
    if (!objects.materials.empty())
      scene.member("materials").fail("expected meshes or spheres with materials, found none");
    options.input = single->file;
    options.raw = single->raw;
    return;
  }
  if (options.objects == nullptr) {
    const char* key = !objects.volumes.empty() ? "volumes" : !objects.meshes.empty() ? "meshes" : "spheres";
    scene.member(key).fail("only freevoxel trace shows these; expected one 'volume'");
  }
  if (single) objects.volumes.insert(objects.volumes.begin(), *single);
  for (VolumeObject& volume : objects.volumes) {
    if (volume.transfer.empty()) volume.transfer = options.transfer;
  }
  *options.objects = std::move(objects);
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
  scene.onlyKeys({"volume", "transfer", "volumes", "meshes", "spheres", "materials", "camera", "image", "lights",
                  "ambient", "shading"});
  readObjects(scene, options);

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
