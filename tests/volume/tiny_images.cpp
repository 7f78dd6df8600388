// Images. What writes them brings hundreds of libraries into the process, which make forks of it slow.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include "tests/support/test_data.h"
#include "tests/volume/damaged_library_file.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

namespace oiio = OIIO;

/// What OpenImageIO writes of slices of 5 x 7 pixels, each a page.
std::string image(const std::string& extension, oiio::TypeDesc type, const std::string& compression, int pages = 1) {
  // These tests fork: no thread may be left behind.
  oiio::attribute("threads", 1);
  oiio::attribute("exr_threads", -1);
  const std::string path = temporaryFolder() + "/image" + extension;
  const auto output = oiio::ImageOutput::create(path);
  oiio::ImageSpec spec(5, 7, 1, type);
  spec.attribute("compression", compression);
  for (int page = 0; page < pages; ++page) {
    EXPECT_TRUE(output->open(path, spec, page == 0 ? oiio::ImageOutput::Create : oiio::ImageOutput::AppendSubimage));
    std::vector<float> pixels;
    for (uint64_t i = 0; i < 35; ++i)
      pixels.push_back(float(testValue(ValueType::u8, uint64_t(page) * 35 + i)) / 255.0f);
    EXPECT_TRUE(output->write_image(oiio::TypeDesc::FLOAT, pixels.data()));
  }
  EXPECT_TRUE(output->close());
  return readBytes(path);
}

std::vector<TinyFile> tinyImages() {
  return {
      {"png", "a.png", image(".png", oiio::TypeDesc::UINT8, "zip")},
      {"png16", "a.png", image(".png", oiio::TypeDesc::UINT16, "zip")},
      {"tiff", "a.tif", image(".tif", oiio::TypeDesc::UINT8, "none")},
      {"tiffZip", "a.tif", image(".tif", oiio::TypeDesc::UINT16, "zip")},
      {"tiffPages", "a.tif", image(".tif", oiio::TypeDesc::UINT8, "lzw", 3)},
      {"exr", "a.exr", image(".exr", oiio::TypeDesc::FLOAT, "none")},
      {"exrZip", "a.exr", image(".exr", oiio::TypeDesc::HALF, "zip")},
  };
}

}  // namespace

INSTANTIATE_TEST_SUITE_P(Images, DamagedLibraryFile, testing::ValuesIn(tinyImages()), NameOf());

}  // namespace freevoxel::test
