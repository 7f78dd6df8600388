// The leaky baseline: kernel splats laid over each other (papers/freevoxels section 4.1, Eq. 9 and Fig. 6).
#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "base/image.h"
#include "splat/kernel_splats.h"

namespace freevoxel {

/// What is blended. Where splats of one plane overlap, opacities a and b leave (1 - a)(1 - b) instead of 1 - a - b:
/// that is the leak, whatever the kernel. The Gaussian leaks more: it does not even add up to the plane's opacity.
enum class BlendKernel {
  normalised,  ///< the kernel of all other formulas, whose weights over a plane of voxels add up to one
  gaussian,    ///< peak 1, standard deviation kGaussianDeviation voxels: the sprites of hardware splatters
};

inline constexpr float kGaussianDeviation = 0.5f;

/// Sorts the splats by distance and lays them over each other from back to front; ties keep their order. Premultiplied
/// linear RGBA. Splats must have been set up with KernelEmission::peak for `gaussian`, else `telescoping`, quantum 1.
Image blendKernels(std::vector<BlendSplat> splats, BlendKernel kernel, glm::ivec2 imageSize);

}  // namespace freevoxel
