#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

namespace oiio = OIIO;

/// Pixels of slice z of the test volume, the value of channel `channel` in each, other channels 0.
template <class T>
std::vector<T> slice(ValueType type, int z, int channels, int channel) {
  std::vector<T> pixels(size_t(35 * channels));
  for (size_t i = 0; i < 35; ++i)
    pixels[i * size_t(channels) + size_t(channel)] = T(testValue(type, uint64_t(z) * 35 + i));
  return pixels;
}

template <class T>
void writeSlice(const std::string& path, ValueType type, oiio::TypeDesc format, int z, int channels = 1,
                int channel = 0) {
  const auto output = oiio::ImageOutput::create(path);
  oiio::ImageSpec spec(5, 7, channels, format);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  ASSERT_TRUE(output->open(path, spec));
  ASSERT_TRUE(output->write_image(format, slice<T>(type, z, channels, channel).data()));
  ASSERT_TRUE(output->close());
}

std::string pngStack(int count = 11) {
  const std::string folder = temporaryFolder();
  for (int z = 0; z < count; ++z)
    writeSlice<uint8_t>(fmt::format("{}/s{}.png", folder, z + 1), ValueType::u8, oiio::TypeDesc::UINT8, z);
  return folder;
}

class ImageStack : public testing::Test {
 protected:
  TestReader reader;
};

}  // namespace

TEST_F(ImageStack, foldersAndPatterns) {
  const std::string png = pngStack();
  expectTestValues(readVolume(png), ValueType::u8);  // s2 before s10
  expectTestValues(readVolume(png + "/s%d.png"), ValueType::u8);
  writeBytes(png + "/notes.txt", "what is no image is passed over");
  expectTestValues(readVolume(png), ValueType::u8);
  const std::string tiff = temporaryFolder(), exr = temporaryFolder();
  for (int z = 0; z < 11; ++z) {
    writeSlice<uint16_t>(fmt::format("{}/s{:03}.tif", tiff, z), ValueType::u16, oiio::TypeDesc::UINT16, z);
    writeSlice<float>(fmt::format("{}/s{:03}.exr", exr, z), ValueType::f32, oiio::TypeDesc::FLOAT, z);
  }
  expectTestValues(readVolume(tiff + "/s%03d.tif"), ValueType::u16);
  expectTestValues(readVolume(exr), ValueType::f32);
  VolumeOptions options;
  options.spacing = glm::dvec3(1.0, 1.0, 2.5);
  EXPECT_EQ(readVolume(tiff, options).header.placement.spacing, glm::dvec3(1.0, 1.0, 2.5));
}

TEST_F(ImageStack, pagesOfATiff) {
  const std::string path = temporaryFolder() + "/pages.tif";
  const auto output = oiio::ImageOutput::create(path);
  const oiio::ImageSpec spec(5, 7, 1, oiio::TypeDesc::INT16);
  for (int z = 0; z < 11; ++z) {
    ASSERT_TRUE(output->open(path, spec, z == 0 ? oiio::ImageOutput::Create : oiio::ImageOutput::AppendSubimage));
    ASSERT_TRUE(output->write_image(oiio::TypeDesc::INT16, slice<int16_t>(ValueType::i16, z, 1, 0).data()));
  }
  ASSERT_TRUE(output->close());
  expectTestValues(readVolume(path), ValueType::i16);
}

TEST_F(ImageStack, channels) {
  const std::string folder = temporaryFolder();
  for (int z = 0; z < 11; ++z)
    writeSlice<uint8_t>(fmt::format("{}/s{:02}.png", folder, z), ValueType::u8, oiio::TypeDesc::UINT8, z, 3, 1);
  EXPECT_NE(inputError([&] { readVolume(folder); }).find("('R', 'G', 'B'); choose one with --component"),
            std::string::npos);
  VolumeOptions options;
  options.component = "G";
  expectTestValues(readVolume(folder, options), ValueType::u8);
}

TEST_F(ImageStack, missingAndMixedSlices) {
  const std::string folder = pngStack();
  std::rename((folder + "/s7.png").c_str(), (folder + "/.hidden").c_str());
  EXPECT_EQ(inputError([&] { readVolume(folder); }), folder + ": slice number 7 is missing, between 6 and 8");
  EXPECT_NE(inputError([&] { readVolume(folder + "/s%d.png"); }).find("number 7 is missing"), std::string::npos);
  const std::string names = pngStack(3);
  writeSlice<uint8_t>(names + "/t4.png", ValueType::u8, oiio::TypeDesc::UINT8, 4);
  EXPECT_NE(inputError([&] { readVolume(names); }).find("images of different names ('s1.png' and 't4.png')"),
            std::string::npos);
  const std::string kinds = pngStack(3);
  writeSlice<uint8_t>(kinds + "/s4.tif", ValueType::u8, oiio::TypeDesc::UINT8, 4);
  EXPECT_NE(inputError([&] { readVolume(kinds); }).find("keep one stack in a folder"), std::string::npos);
  const std::string types = pngStack(3);
  writeSlice<uint16_t>(types + "/s4.png", ValueType::u16, oiio::TypeDesc::UINT16, 4);
  EXPECT_NE(inputError([&] { readVolume(types); }).find("s4.png: expected 5 x 7 pixels of type u8"), std::string::npos);
  const std::string empty = temporaryFolder();
  EXPECT_NE(inputError([&] { readVolume(empty); }).find("holds neither DICOM files nor"), std::string::npos);
}

TEST_F(ImageStack, truncationsFail) {
  const std::string folder = pngStack(3);
  const std::string whole = readBytes(folder + "/s2.png");
  for (size_t length = 0; length < whole.size(); length += 23) {
    writeBytes(folder + "/s2.png", whole.substr(0, length));
    EXPECT_THROW(readVolume(folder), InputError) << length;
  }
  const std::string tiff = temporaryFolder() + "/a.tif", exr = temporaryFolder() + "/a.exr";
  writeSlice<uint8_t>(tiff, ValueType::u8, oiio::TypeDesc::UINT8, 0);
  writeSlice<float>(exr, ValueType::f32, oiio::TypeDesc::FLOAT, 0);
  for (const std::string& path : {tiff, exr}) {
    const std::string content = readBytes(path);
    for (const size_t part : {0, 1, 4, 7}) {
      writeBytes(path, content.substr(0, content.size() * part / 8));
      EXPECT_THROW(readVolume(path), InputError) << path << " " << part;
    }
  }
}

}  // namespace freevoxel::test
