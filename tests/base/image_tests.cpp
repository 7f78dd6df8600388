// Pictures through their files and back.
#include "base/image.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <regex>

#include "base/address_sanitizer.h"
#include "base/compare.h"
#include "base/error.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

const std::vector<std::string> kRgba{"R", "G", "B", "A"};
const std::vector<std::string> kSums{"R", "G", "B", "O", "DepthHigh", "DepthLow"};
const ImageMetadata kMetadata{{"Software", "freevoxel test"}, {"Command", "freevoxel render a.fvx -o 'b c.png'"}};

bool sameBits(const Image& a, const Image& b) {
  return a.size == b.size && a.channels == b.channels &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(float)) == 0;
}

/// Every channel of every pixel another number, awkward ones among them.
Image awkward(glm::ivec2 size, int channels) {
  Image image(size, channels);
  for (size_t i = 0; i < image.pixels.size(); ++i)
    image.pixels[i] = float(i) * 0x1.234p-7f;
  const float odd[] = {NAN,   INFINITY, -INFINITY, -0.0f, std::numeric_limits<float>::denorm_min(),
                       -1.5f, 0x1p-20f, 0x1p127f};
  std::copy(std::begin(odd), std::end(odd), image.pixels.begin() + 3);
  return image;
}

TEST(Srgb, knownValuesAndInverse) {
  EXPECT_EQ(srgbFromLinear(0.0f), 0.0f);
  EXPECT_EQ(srgbFromLinear(1.0f), 1.0f);
  EXPECT_EQ(srgbFromLinear(-3.0f), 0.0f);
  EXPECT_EQ(srgbFromLinear(7.0f), 1.0f);
  EXPECT_EQ(srgbFromLinear(NAN), 0.0f);
  EXPECT_NEAR(srgbFromLinear(0.2140411f), 0.5f, 1e-6);
  EXPECT_NEAR(srgbFromLinear(0.002f), 0.02584f, 1e-6);
  for (int code = 0; code <= 255; ++code) {
    EXPECT_EQ(std::lround(255.0f * srgbFromLinear(linearFromSrgb(float(code) / 255.0f))), code);
  }
}

TEST(ExrFile, keepsEveryBitAndTheOrderOfChannels) {
  const std::string path = test::temporaryFolder() + "/sums.exr";
  const Image image = awkward({7, 5}, 6);
  writeExr(path, image, kSums, kMetadata);
  EXPECT_TRUE(sameBits(readImage(path), image));
  EXPECT_EQ(readImageCommand(path), "freevoxel render a.fvx -o 'b c.png'");
}

TEST(ExrFile, pictureWithAlpha) {
  const std::string path = test::temporaryFolder() + "/picture.exr";
  const Image image = awkward({17, 70}, 4);  // several compressed chunks
  writeExr(path, image, kRgba, kMetadata);
  EXPECT_TRUE(sameBits(readImage(path), image));
}

TEST(PngFile, opaqueCodesAreRounded) {
  const std::string path = test::temporaryFolder() + "/picture.png";
  Image image(glm::ivec2(256, 3), 4);
  for (int x = 0; x < 256; ++x) {
    image.at(x, 0)[0] = linearFromSrgb(float(x) / 255.0f);
    image.at(x, 1)[1] = linearFromSrgb((float(x) + 0.49f) / 255.0f);
    image.at(x, 2)[2] = linearFromSrgb((float(x) - 0.49f) / 255.0f);
  }
  writePng(path, image, kMetadata);
  const Image back = readImage(path);
  ASSERT_EQ(back.size, image.size);
  ASSERT_EQ(back.channels, 3);
  for (int x = 0; x < 256; ++x) {
    for (int row = 0; row < 3; ++row) {
      EXPECT_EQ(back.at(x, row)[row], linearFromSrgb(float(x) / 255.0f)) << x << " " << row;
    }
  }
  EXPECT_EQ(readImageCommand(path), "freevoxel render a.fvx -o 'b c.png'");
}

TEST(PngFile, keepsStraightAlpha) {
  const std::string path = test::temporaryFolder() + "/picture.png";
  Image image(glm::ivec2(2, 1), 4);
  const float half = 128.0f / 255.0f;
  const float premultiplied[] = {half * linearFromSrgb(200.0f / 255.0f), half * linearFromSrgb(100.0f / 255.0f), 0.0f,
                                 half};
  std::copy(std::begin(premultiplied), std::end(premultiplied), image.at(1, 0));
  writePng(path, image, kMetadata, true);
  const Image back = readImage(path);
  ASSERT_EQ(back.channels, 4);
  for (int c = 0; c < 4; ++c) {
    EXPECT_NEAR(back.at(1, 0)[c], premultiplied[c], 1e-6) << c;
    EXPECT_EQ(back.at(0, 0)[c], 0.0f);
  }
}

TEST(PngFile, awkwardNumbersBecomeCodes) {
  const std::string path = test::temporaryFolder() + "/picture.png";
  writePng(path, awkward({7, 5}, 4), kMetadata);
  for (const float channel : readImage(path).pixels)
    EXPECT_TRUE(channel >= 0.0f && channel <= 1.0f);
}

TEST(ImageFile, equalPicturesGiveEqualFiles) {
  const std::string folder = test::temporaryFolder();
  const Image image = awkward({7, 5}, 4);
  writeExr(folder + "/a.exr", image, kRgba, kMetadata);
  writeExr(folder + "/b.exr", image, kRgba, kMetadata);
  writePng(folder + "/a.png", image, kMetadata);
  writePng(folder + "/b.png", image, kMetadata);
  EXPECT_EQ(test::readBytes(folder + "/a.exr"), test::readBytes(folder + "/b.exr"));
  EXPECT_EQ(test::readBytes(folder + "/a.png"), test::readBytes(folder + "/b.png"));
  // Nor on the day: a date in an EXR header reads like 2024:01:31, a PNG's has its own chunk.
  EXPECT_FALSE(std::regex_search(test::readBytes(folder + "/a.exr"), std::regex("[0-9]{4}:[0-9]{2}:[0-9]{2}")));
  EXPECT_EQ(test::readBytes(folder + "/a.png").find("tIME"), std::string::npos);
}

TEST(ImageFile, failedWriteLeavesNothing) {
  const std::string folder = test::temporaryFolder();
  EXPECT_THROW(writePng(folder + "/missing/a.png", awkward({3, 5}, 4), kMetadata), MachineError);
  EXPECT_THROW(writeExr(folder, awkward({3, 5}, 4), kRgba, kMetadata), MachineError);
  EXPECT_TRUE(test::listFolder(folder).empty());
}

/// Reading must throw an InputError of one line or, where the damage hides in unread bytes, give an image. Whether it
/// threw.
bool expectGracefulRead(const std::string& path, const std::string& what) {
  try {
    readImage(path);
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    EXPECT_EQ(text.find(path), 0u) << text;
    return true;
  } catch (const std::exception& error) {
    ADD_FAILURE() << what << ": " << error.what();
  }
  return false;
}

/// Every byte, but under the sanitizers only some: there an exception out of OpenEXR takes a tenth of a second.
constexpr size_t kDamageStep = kUnderAddressSanitizer ? 31 : 1;

class DamagedImage : public ::testing::TestWithParam<const char*> {
 protected:
  std::string write(const std::string& path) const {
    const Image image = awkward({7, 5}, 4);
    if (path.ends_with("png")) {
      writePng(path, image, {{"Command", "c"}});
    } else {
      writeExr(path, image, kRgba, {{"Command", "c"}});
    }
    return test::readBytes(path);
  }
};

TEST_P(DamagedImage, everyTruncationIsRefused) {
  const std::string path = test::temporaryFolder() + "/image." + GetParam();
  const std::string bytes = write(path);
  testing::internal::CaptureStderr();
  for (size_t length = 0; length < bytes.size(); length += kDamageStep) {
    test::writeBytes(path, bytes.substr(0, length));
    EXPECT_TRUE(expectGracefulRead(path, "length " + std::to_string(length))) << length;
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST_P(DamagedImage, everyFlippedByteIsSurvived) {
  const std::string path = test::temporaryFolder() + "/image." + GetParam();
  const std::string bytes = write(path);
  testing::internal::CaptureStderr();
  for (size_t i = 0; i < bytes.size(); i += kDamageStep) {
    for (const unsigned flip : {0x01u, 0x80u, 0xffu}) {
      std::string damaged = bytes;
      damaged[i] = char(static_cast<unsigned char>(damaged[i]) ^ flip);
      test::writeBytes(path, damaged);
      expectGracefulRead(path, "byte " + std::to_string(i));
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

INSTANTIATE_TEST_SUITE_P(Formats, DamagedImage, ::testing::Values("png", "exr"),
                         [](const auto& testInfo) { return std::string(testInfo.param); });

TEST(ImageFile, refusesWhatIsNoImage) {
  const std::string folder = test::temporaryFolder();
  test::writeBytes(folder + "/text.png", "not an image at all");
  EXPECT_THROW(readImage(folder + "/text.png"), InputError);
  EXPECT_THROW(readImage(folder + "/missing.png"), InputError);
  EXPECT_THROW(readImage(folder), InputError);
}

}  // namespace
}  // namespace freevoxel
