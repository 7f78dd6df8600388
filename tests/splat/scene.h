// Small scenes made in memory, as an attenuation file and as a grid of values.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/camera.h"
#include "hierarchy/attenuation_file.h"
#include "hierarchy/value_grid.h"
#include "splat/raycast.h"
#include "splat/splat.h"
#include "volume/transfer_function.h"
#include "volume/volume.h"

namespace freevoxel::test {

/// The paper's footprint.
const SplatOptions kKernel = {.footprint = Footprint::kernel};

/// A volume, what it looks like, and the file precomputed from both.
struct Scene {
  Volume volume;
  TransferFunction transfer;
  std::unique_ptr<AttenuationFile> file;

  ValueGrid grid() const { return valueGrid(volume, transfer); }
  Box bounds() const { return worldBounds(volume.header.placement, volume.header.dims); }
};

/// A u8 volume whose values `value(x, y, z)` gives.
Volume makeVolume(glm::ivec3 dims, glm::dvec3 spacing, const std::function<int(int, int, int)>& value);

/// White, opacity rising linearly from 0 at value 0 to `opacity` at value 255.
TransferFunction whiteRamp(double opacity);
/// Every value from 1 on has `opacity` and the colour `srgb`.
TransferFunction uniformOpacity(double opacity, glm::dvec3 srgb = glm::dvec3(1.0));

/// Classification `voxel` is what the closed forms of kernels hold for.
Scene makeScene(Volume volume, TransferFunction transfer, int brickEdge = 16,
                Classification classification = Classification::voxel);

/// 5 x 7 x 11 voxels of unequal spacing with values from a small generator, coloured by value.
Scene awkwardScene();

/// Cameras round a box at fixed pseudo-random directions, framed to fit.
std::vector<Camera> randomViews(const Box& box, int count, glm::ivec2 imageSize);

/// A camera that looks along -z at the centre of the box, orthographic, `height` world lengths high.
Camera axisView(const Box& box, glm::ivec2 imageSize, double height);

/// From the scene's attenuation file.
SplatResult splatScene(const Scene& scene, const Camera& camera, const SplatOptions& options = {},
                       Backend backend = Backend::cpu);
Image raycastScene(const Scene& scene, const Camera& camera, const RaycastOptions& options = {});

}  // namespace freevoxel::test
