// One world for all files: x to the patient's right is +x, front +y, head +z. A volume of 2 x 3 x 4 voxels whose voxel
// (1,2,3) is marked, told by each format where it lies.
#include <gtest/gtest.h>

#include <glm/glm.hpp>

#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"
#include "volume/world_space.h"

namespace freevoxel::test {

namespace {

const std::string kMarked = std::string(23, '\0') + 'x';

/// World position of the marked voxel, which the file places.
glm::dvec3 markedPlace(const std::string& content, const std::string& name) {
  const Volume volume = readVolume(fileOf(content, name));
  EXPECT_EQ(volume.header.dims, glm::ivec3(2, 3, 4));
  EXPECT_EQ(volume.value(linearIndex({1, 2, 3}, volume.header.dims)), double('x'));
  return glm::dvec3(volume.header.placement.worldFromIndex() * glm::dvec4(1.0, 2.0, 3.0, 1.0));
}

glm::dvec3 nrrdPlace(const std::string& space) {
  return markedPlace("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 3 4\nencoding: raw\n" + space +
                         "space directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (10,20,30)\n\n" + kMarked,
                     "v.nrrd");
}

Bytes niftiHeader() {
  Bytes bytes;
  bytes.zeros(352).put<int32_t>(0, 348).put<int16_t>(70, 2).put<int16_t>(72, 8).put<float>(108, 352.0f);
  const int16_t dim[] = {3, 2, 3, 4, 1, 1, 1, 1};
  const float pixdim[] = {1, 2, 3, 4, 1, 1, 1, 1};
  for (size_t i = 0; i < 8; ++i)
    bytes.put<int16_t>(40 + 2 * i, dim[i]).put<float>(76 + 4 * i, pixdim[i]);
  return bytes.put<uint32_t>(344, 0x00312b6eu);
}

void expectNear(glm::dvec3 found, glm::dvec3 expected) {
  EXPECT_LT(glm::distance(found, expected), 1e-5) << found.x << " " << found.y << " " << found.z;
}

}  // namespace

TEST(Orientation, nrrdSpaces) {
  expectNear(nrrdPlace("space: right-anterior-superior\n"), {12, 26, 42});
  expectNear(nrrdPlace("space: RAS\n"), {12, 26, 42});
  expectNear(nrrdPlace("space: left-posterior-superior\n"), {-12, -26, 42});
  expectNear(nrrdPlace("space: left-anterior-superior\n"), {-12, 26, 42});
  expectNear(nrrdPlace("space: scanner-xyz\n"), {12, 26, 42});
  expectNear(nrrdPlace("space: 3D-right-handed\n"), {12, 26, 42});
  expectNear(nrrdPlace("space: 3D-left-handed\n"), {12, 26, -42});
  expectNear(nrrdPlace("space dimension: 3\n"), {12, 26, 42});
}

TEST(Orientation, metaImageIsLps) {
  const std::string start =
      "NDims = 3\nDimSize = 2 3 4\nElementType = MET_UCHAR\nElementSpacing = 2 3 4\nOffset = 10 20 30\n";
  const std::string end = "ElementDataFile = LOCAL\n" + kMarked;
  expectNear(markedPlace(start + "TransformMatrix = 1 0 0 0 1 0 0 0 1\n" + end, "v.mha"), {-12, -26, 42});
  // The first row is where x leads to: to +y of the patient's space, -y of ours.
  expectNear(markedPlace(start + "TransformMatrix = 0 1 0 -1 0 0 0 0 1\n" + end, "v.mha"), {-4, -22, 42});
  expectNear(markedPlace(start + end, "v.mha"), {12, 26, 42});
}

TEST(Orientation, niftiPrefersSform) {
  Bytes header = niftiHeader();
  expectNear(markedPlace(header.str() + kMarked, "v.nii"), {2, 6, 12});
  // qform: half a turn about z (a = b = c = 0, d = 1), then also with the third axis reflected.
  header.put<int16_t>(252, 1)
      .put<float>(264, 1.0f)
      .put<float>(268, 10.0f)
      .put<float>(272, 20.0f)
      .put<float>(276, 30.0f);
  expectNear(markedPlace(header.str() + kMarked, "v.nii"), {8, 14, 42});
  header.put<float>(76, -1.0f);
  expectNear(markedPlace(header.str() + kMarked, "v.nii"), {8, 14, 18});
  // A quarter turn about x: y leads to z.
  header.put<float>(76, 1.0f).put<float>(264, 0.0f).put<float>(256, std::sqrt(0.5f));
  expectNear(markedPlace(header.str() + kMarked, "v.nii"), {12, 8, 36});
  // sform: x mirrored.
  header.put<int16_t>(254, 2).put<float>(280, -2.0f).put<float>(292, 90.0f);
  header.put<float>(300, 3.0f).put<float>(308, -126.0f).put<float>(320, 4.0f).put<float>(324, -72.0f);
  expectNear(markedPlace(header.str() + kMarked, "v.nii"), {88, -120, -60});
  // In metres.
  header.put<uint8_t>(123, 1);
  expectNear(markedPlace(header.str() + kMarked, "v.nii"), {88000, -120000, -60000});
}

TEST(Orientation, obliqueAndSheared) {
  const double c = std::cos(0.4), s = std::sin(0.4);
  const glm::dmat3 turned(glm::dvec3(c, s, 0) * 2.0, glm::dvec3(-s, c, 0) * 3.0, glm::dvec3(0.3, 0, 1));
  const Placement placement = placeInWorld(turned, {1, 2, 3}, FileSpace::lps, "here");
  EXPECT_NEAR(placement.spacing.x, 2.0, 1e-12);
  EXPECT_NEAR(placement.spacing.y, 3.0, 1e-12);
  expectNear(glm::dvec3(placement.worldFromIndex() * glm::dvec4(1, 1, 1, 1)),
             {-(1 + 2 * c - 3 * s + 0.3), -(2 + 2 * s + 3 * c), 4});
  EXPECT_EQ(inputError([&] {
              placeInWorld(glm::dmat3(glm::dvec3(1), glm::dvec3(1), {0, 0, 1}), {}, FileSpace::ras, "here");
            }),
            "here: expected three axes that do not lie in one plane");
  EXPECT_EQ(inputError([&] { placeInWorld(glm::dmat3(0.0), {}, FileSpace::ras, "here"); }),
            "here: expected a voxel edge of positive length for axis x, found (0, 0, 0)");
}

TEST(Orientation, nothingIsMirrored) {
  // A right-handed file stays so; a left-handed space, in which axes along its own are left-handed, becomes mirrored
  // data.
  for (const FileSpace space : {FileSpace::ras, FileSpace::lps, FileSpace::unnamed}) {
    EXPECT_GT(glm::determinant(placeInWorld(glm::dmat3(1.0), {}, space, "").direction), 0.0);
  }
  for (const FileSpace space : {FileSpace::las, FileSpace::leftHanded}) {
    EXPECT_LT(glm::determinant(placeInWorld(glm::dmat3(1.0), {}, space, "").direction), 0.0);
  }
}

}  // namespace freevoxel::test
