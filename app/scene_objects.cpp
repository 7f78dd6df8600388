#include "app/scene_objects.h"

#include "app/scene_reading.h"
#include "base/image.h"

namespace freevoxel {

namespace {

constexpr size_t kMostObjects = 10000;

template <class Read>
void readList(const JsonPlace& scene, const char* key, Read&& read) {
  if (!scene.has(key)) return;
  const JsonPlace list = scene.member(key);
  list.size(0, kMostObjects, "a list of objects");
  for (size_t i = 0; i < list.size(); ++i)
    read(list.element(i));
}

ObjectPlace readPlace(const JsonPlace& object) {
  ObjectPlace place;
  if (object.has("scale")) place.scale = object.member("scale").number(1e-9, 1e9);
  if (object.has("rotate")) place.rotateDegrees = object.member("rotate").triple(-1e6, 1e6, "[x, y, z] in degrees");
  if (object.has("translate"))
    place.translate = object.member("translate").triple(-kLargestPlace, kLargestPlace, "[x, y, z]");
  return place;
}

std::string readMaterialName(const JsonPlace& object) {
  return object.has("material") ? object.member("material").text() : std::string();
}

VolumeObject readVolume(const JsonPlace& object, const std::string& scenePath) {
  object.onlyKeys({"file", "transfer", "dims", "type", "endian", "skip", "spacing", "component", "frame", "labels",
                   "scale", "rotate", "translate"});
  VolumeObject volume;
  volume.file = besideScene(scenePath, object.member("file").text());
  if (object.has("transfer")) volume.transfer = transferBesideScene(scenePath, object.member("transfer").text());
  volume.raw = readRawOptions(object);
  volume.place = readPlace(object);
  return volume;
}

MeshObject readMeshObject(const JsonPlace& object, const std::string& scenePath) {
  object.onlyKeys({"file", "material", "smooth", "scale", "rotate", "translate"});
  MeshObject mesh;
  mesh.file = besideScene(scenePath, object.member("file").text());
  mesh.material = readMaterialName(object);
  if (object.has("smooth")) mesh.smooth = object.member("smooth").flag();
  mesh.place = readPlace(object);
  return mesh;
}

SpheresObject readSpheresObject(const JsonPlace& object, const std::string& scenePath) {
  object.onlyKeys({"file", "center", "radius", "copies", "material", "scale", "rotate", "translate"});
  if (object.has("file") == object.has("center")) object.fail("expected either 'file' or 'center'");
  SpheresObject spheres;
  if (object.has("radius")) spheres.options.radius = float(object.member("radius").number(1e-30, 1e30));
  if (object.has("file")) {
    spheres.file = besideScene(scenePath, object.member("file").text());
    if (object.has("copies")) spheres.options.copies = object.member("copies").flag();
  } else {
    if (object.has("copies")) object.fail("expected a key 'file' with 'copies', found none");
    spheres.centre = object.member("center").triple(-kLargestPlace, kLargestPlace, "[x, y, z]");
    object.member("radius");  // is needed
  }
  spheres.material = readMaterialName(object);
  spheres.place = readPlace(object);
  return spheres;
}

MaterialChange readMaterial(const JsonPlace& place) {
  place.onlyKeys({"kind", "color", "opacity", "reflectance", "indexOfRefraction"});
  MaterialChange change;
  change.where = place.where();
  if (place.has("kind")) {
    change.kind = oneOf<MaterialKind>(
        place.member("kind"),
        {{"diffuse", MaterialKind::diffuse}, {"mirror", MaterialKind::mirror}, {"glass", MaterialKind::glass}});
  }
  if (place.has("color")) {
    const glm::dvec3 srgb = place.member("color").triple(0.0, 1.0, "[red, green, blue]");
    change.linear.emplace();
    for (int c = 0; c < 3; ++c)
      (*change.linear)[c] = linearFromSrgb(float(srgb[c]));
  }
  const auto number = [&](const char* key, double low, double high) -> std::optional<float> {
    if (!place.has(key)) return std::nullopt;
    return float(place.member(key).number(low, high));
  };
  change.opacity = number("opacity", 0.0, 1.0);
  change.reflectance = number("reflectance", 0.0, 1.0);
  change.indexOfRefraction = number("indexOfRefraction", 1.0, 4.0);
  return change;
}

}  // namespace

SceneObjects readSceneObjects(const JsonPlace& scene, const std::string& scenePath) {
  SceneObjects objects;
  readList(scene, "volumes", [&](const JsonPlace& place) { objects.volumes.push_back(readVolume(place, scenePath)); });
  readList(scene, "meshes",
           [&](const JsonPlace& place) { objects.meshes.push_back(readMeshObject(place, scenePath)); });
  readList(scene, "spheres",
           [&](const JsonPlace& place) { objects.spheres.push_back(readSpheresObject(place, scenePath)); });
  if (scene.has("materials")) {
    const JsonPlace materials = scene.member("materials");
    if (!materials.value().is_object()) materials.fail("expected an object: materials by their names");
    for (const auto& [name, value] : materials.value().items())
      objects.materials.emplace(name, readMaterial(materials.member(name.c_str())));
  }
  return objects;
}

}  // namespace freevoxel
