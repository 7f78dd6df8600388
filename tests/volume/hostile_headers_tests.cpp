// Headers with any one byte changed are read or refused; nothing else happens.
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test::hostile_headers_tests {

namespace {

const std::string kBytes = testBytes(ValueType::u8, ByteOrder::big);

/// Reads the file with each of its first `headerBytes` bytes changed in several ways.
void expectReadOrRefused(const std::string& path, size_t headerBytes) {
  const std::string whole = readBytes(path);
  size_t refused = 0;
  for (size_t i = 0; i < headerBytes; ++i) {
    for (const char c : {'\0', '\n', '9', '-', ' ', '\xff', '\x7f'}) {
      std::string changed = whole;
      changed[i] = c;
      writeBytes(path, changed);
      VolumeOptions options;
      options.frame = 0;
      try {
        readVolume(path, options);
      } catch (const InputError& error) {
        ++refused;
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    }
  }
  EXPECT_GT(refused, 0u);
}

void expectReadOrRefused(const std::string& header, const std::string& name, const std::string& values) {
  const std::string path = fileOf(header + values, name);
  EXPECT_NO_THROW(readVolume(path));
  expectReadOrRefused(path, header.size());
}

}  // namespace

TEST(HostileHeaders, metaImage) {
  expectReadOrRefused(
      "NDims = 3\nDimSize = 5 7 11\nElementType = MET_UCHAR\nElementSpacing = 1 2 3\nOffset = 1 2 3\n"
      "TransformMatrix = 1 0 0 0 1 0 0 0 1\nElementNumberOfChannels = 1\nElementDataFile = LOCAL\n",
      "v.mha", kBytes);
}

TEST(HostileHeaders, nifti) {
  Bytes header(ByteOrder::big);
  header.zeros(352).put<int32_t>(0, 348).put<int16_t>(70, 2).put<int16_t>(72, 8).put<float>(108, 352.0f);
  const int16_t dim[] = {3, 5, 7, 11, 1, 1, 1, 1};
  for (size_t i = 0; i < 8; ++i)
    header.put<int16_t>(40 + 2 * i, dim[i]).put<float>(76 + 4 * i, 1.0f);
  header.put<uint32_t>(344, 0x6e2b3100u).put<int16_t>(252, 1).put<int16_t>(254, 1);
  for (const size_t offset : {280, 300, 320})
    header.put<float>(offset, 1.0f);
  expectReadOrRefused(header.str(), "v.nii", kBytes);
}

TEST(HostileHeaders, legacyVtk) {
  expectReadOrRefused(
      "# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\nDIMENSIONS 5 7 11\nSPACING 1 2 3\n"
      "ORIGIN 0 0 0\nPOINT_DATA 385\nSCALARS s unsigned_char 1\nLOOKUP_TABLE default\n",
      "v.vtk", kBytes);
}

TEST(HostileHeaders, numpy) {
  std::string text = "{'descr': '|u1', 'fortran_order': False, 'shape': (11, 7, 5), }";
  text.resize(118, ' ');
  expectReadOrRefused(Bytes().text("\x93NUMPY").add(uint8_t(1)).add(uint8_t(0)).add(uint16_t(118)).text(text).str(),
                      "v.npy", kBytes);
}

TEST(HostileHeaders, dat) {
  const std::string folder = temporaryFolder() + "/";
  const std::string header =
      "ObjectFileName: v.raw\nResolution: 5 7 11\nSliceThickness: 1 2 3\nFormat: UCHAR\nObjectModel: I\n";
  writeBytes(folder + "v.raw", kBytes);
  writeBytes(folder + "v.dat", header);
  expectReadOrRefused(folder + "v.dat", header.size());
}

}  // namespace freevoxel::test::hostile_headers_tests
