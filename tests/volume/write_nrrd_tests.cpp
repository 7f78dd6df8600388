#include "volume/write_nrrd.h"

#include <gtest/gtest.h>

#include <cstring>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

Volume exampleVolume(ValueType type) {
  Volume volume;
  volume.header.dims = kDims;
  volume.header.type = type;
  volume.header.placement.spacing = {0.1, 1.0 / 3.0, 2.5};
  volume.header.placement.origin = {-7.25, 1e-3, 12.0};
  const std::string bytes = testBytes(type, ByteOrder::little);
  volume.data.resize(bytes.size());
  std::memcpy(volume.data.data(), bytes.data(), bytes.size());
  return volume;
}

}  // namespace

TEST(WriteNrrd, roundTripIsExact) {
  for (const ValueType type : kAllTypes) {
    for (const bool compress : {false, true}) {
      const Volume volume = exampleVolume(type);
      const std::string path = temporaryFolder() + "/v.nrrd";
      writeNrrd(path, volume, compress);
      const Volume back = readVolume(path);
      expectTestValues(back, type);
      EXPECT_EQ(back.header.placement.spacing, volume.header.placement.spacing);
      EXPECT_EQ(back.header.placement.origin, volume.header.placement.origin);
      EXPECT_EQ(back.header.placement.direction, volume.header.placement.direction);
    }
  }
}

TEST(WriteNrrd, turnedAxesComeBack) {
  Volume volume = exampleVolume(ValueType::u8);
  volume.header.placement.direction = glm::dmat3(0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0);
  const std::string path = temporaryFolder() + "/v.nrrd";
  writeNrrd(path, volume, false);
  const Placement back = readVolume(path).header.placement;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(back.spacing[axis], volume.header.placement.spacing[axis], 1e-15);
    for (int row = 0; row < 3; ++row) {
      EXPECT_NEAR(back.direction[axis][row], volume.header.placement.direction[axis][row], 1e-15);
    }
  }
}

TEST(WriteNrrd, piecesAreTheWhole) {
  const Volume volume = exampleVolume(ValueType::f32);
  for (const bool compress : {false, true}) {
    const std::string folder = temporaryFolder();
    writeNrrd(folder + "/whole.nrrd", volume, compress);
    NrrdWriter writer(folder + "/pieces.nrrd", volume.header, compress);
    const std::span<const std::byte> data(volume.data);
    writer.append(data.first(140));
    writer.append({});
    writer.append(data.subspan(140));
    writer.finish();
    EXPECT_EQ(readBytes(folder + "/pieces.nrrd"), readBytes(folder + "/whole.nrrd"));
  }
}

TEST(WriteNrrd, unfinishedFilesDoNotAppear) {
  const std::string folder = temporaryFolder();
  const Volume volume = exampleVolume(ValueType::u8);
  {
    NrrdWriter writer(folder + "/v.nrrd", volume.header, true);
    writer.append(std::span(volume.data).first(100));
    EXPECT_THROW(writer.finish(), InternalError);
  }
  EXPECT_TRUE(listFolder(folder).empty());
  EXPECT_THROW(writeNrrd(folder + "/missing/v.nrrd", volume, false), MachineError);
}

}  // namespace freevoxel::test
