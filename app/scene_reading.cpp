#include "app/scene_reading.h"

#include <algorithm>
#include <filesystem>

#include "volume/transfer_presets.h"

namespace freevoxel {

namespace {

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

}  // namespace

std::string besideScene(const std::string& scene, const std::string& name) {
  const std::filesystem::path path(name);
  return path.is_absolute() ? name : (std::filesystem::path(scene).parent_path() / path).string();
}

std::string transferBesideScene(const std::string& scene, const std::string& name) {
  const std::vector<TransferPreset>& presets = transferPresets();
  const bool isPreset =
      std::any_of(presets.begin(), presets.end(), [&](const TransferPreset& preset) { return preset.name == name; });
  return isPreset ? name : besideScene(scene, name);
}

VolumeOptions readRawOptions(const JsonPlace& volume) {
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

}  // namespace freevoxel
