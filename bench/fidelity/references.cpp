#include "bench/fidelity/references.h"

#include <fmt/core.h>
#include <xxhash.h>

#include <filesystem>

namespace freevoxel::bench {

Image reference(const Scene& scene, const Camera& camera, const RaycastOptions& options, const Folders& folders) {
  static const std::vector<std::string> kChannels = {"R", "G", "B", "A"};
  const std::string what = fmt::format("{} {} {} {} {} {} {} {} {} {} {}x{} {} {}", camera.eye.x, camera.eye.y,
                                       camera.eye.z, camera.target.x, camera.target.y, camera.target.z, camera.up.x,
                                       camera.up.y, camera.up.z, camera.verticalFov, camera.imageSize.x,
                                       camera.imageSize.y, int(options.classification), options.step);
  const std::string path = fmt::format("{}/{}-{:016x}.exr", folders.cache, scene.source.name,
                                       XXH3_64bits_withSeed(what.data(), what.size(), scene.hash));
  if (std::filesystem::exists(path)) return readImage(path);
  const Image image = raycast(scene.grid, scene.transfer, camera, options, silentProgress());
  writeExr(path, image, kChannels, {{"Software", "freevoxel"}, {"Command", what}});
  return image;
}

}  // namespace freevoxel::bench
