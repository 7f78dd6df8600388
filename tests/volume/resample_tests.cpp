#include "volume/resample.h"

#include <gtest/gtest.h>

#include <cstring>
#include <glm/glm.hpp>

#include "base/error.h"

namespace freevoxel::test {
namespace {

/// 7 x 5 x 9 floats of unequal spacing that rise linearly in world space.
Volume linearVolume() {
  Volume volume;
  volume.header.dims = {7, 5, 9};
  volume.header.type = ValueType::f32;
  volume.header.placement.spacing = {1.0, 2.0, 0.5};
  volume.header.placement.origin = {10.0, -3.0, 4.0};
  std::vector<float> values;
  for (int z = 0; z < 9; ++z) {
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 7; ++x)
        values.push_back(3.0f * float(x) - 2.0f * 2.0f * float(y) + 0.5f * float(z));
    }
  }
  volume.data.resize(volume.header.bytes());
  std::memcpy(volume.data.data(), values.data(), volume.data.size());
  return volume;
}

TEST(Resample, KeepsTheBoxAndALinearField) {
  const Volume volume = linearVolume();
  const Box box = worldBounds(volume.header.placement, volume.header.dims);
  for (const glm::ivec3 dims :
       {glm::ivec3(14, 11, 20), glm::ivec3(3, 2, 4), glm::ivec3(7, 5, 9), glm::ivec3(1, 1, 1)}) {
    const Volume other = resampled(volume, dims);
    const Box otherBox = worldBounds(other.header.placement, dims);
    EXPECT_LT(glm::length(otherBox.lower - box.lower) + glm::length(otherBox.upper - box.upper), 1e-9);
    for (int z = 0; z < dims.z; ++z) {
      for (int y = 0; y < dims.y; ++y) {
        for (int x = 0; x < dims.x; ++x) {
          // Beyond the outermost samples values are theirs.
          const glm::dvec3 index =
              glm::clamp((glm::dvec3(x, y, z) + 0.5) * glm::dvec3(volume.header.dims) / glm::dvec3(dims) - 0.5,
                         glm::dvec3(0.0), glm::dvec3(volume.header.dims - 1));
          EXPECT_NEAR(other.value(linearIndex({x, y, z}, dims)), 3.0 * index.x - 4.0 * index.y + 0.5 * index.z, 1e-5);
        }
      }
    }
  }
  EXPECT_EQ(resampled(volume, volume.header.dims).data, volume.data);
}

TEST(Resample, DimsFollowTheLongestEdge) {
  VolumeHeader header = linearVolume().header;  // 7 x 10 x 4.5 long
  EXPECT_EQ(resampledDims(header, 100), glm::ivec3(70, 100, 45));
  EXPECT_EQ(resampledDims(header, 1), glm::ivec3(1, 1, 1));
}

TEST(Resample, LabelsAreNotMixed) {
  Volume volume = linearVolume();
  volume.header.type = ValueType::u8;
  volume.header.labels = true;
  volume.data.assign(volume.header.bytes(), std::byte(0));
  for (size_t i = 0; i < volume.data.size(); i += 2)
    volume.data[i] = std::byte(200);
  const Volume other = resampled(volume, {13, 17, 11});
  for (const std::byte value : other.data)
    EXPECT_TRUE(value == std::byte(0) || value == std::byte(200));
}

TEST(Resample, RefusesWhatNoMachineHolds) {
  EXPECT_THROW(resampled(linearVolume(), glm::ivec3(kMaxDim)), MachineError);
  EXPECT_THROW(resampled(linearVolume(), {4, 0, 4}), InputError);
}

}  // namespace
}  // namespace freevoxel::test
