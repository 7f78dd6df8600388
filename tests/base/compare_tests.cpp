// Differences known in closed form.
#include "base/compare.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.h"

namespace freevoxel {
namespace {

Image uniform(glm::ivec2 size, float value) {
  Image image(size, 4);
  for (float& channel : image.pixels)
    channel = value;
  return image;
}

TEST(Compare, identicalPictures) {
  const Image image = uniform({13, 9}, 0.25f);
  const ImageDifference difference = compareImages(image, image);
  EXPECT_TRUE(difference.identical);
  EXPECT_EQ(difference.differingBytes, 0u);
  EXPECT_EQ(difference.coveredPixels, 117u);
  EXPECT_EQ(difference.rms, 0.0);
  EXPECT_EQ(difference.maxError, 0.0);
  EXPECT_EQ(difference.psnr, std::numeric_limits<double>::infinity());
  EXPECT_NEAR(difference.ssim, 1.0, 1e-12);
}

TEST(Compare, uniformErrorOfATenthIsTwentyDecibels) {
  const ImageDifference difference = compareImages(uniform({13, 9}, 0.5f), uniform({13, 9}, 0.6f));
  EXPECT_FALSE(difference.identical);
  EXPECT_NEAR(difference.rms, 0.1, 1e-6);
  EXPECT_NEAR(difference.psnr, 20.0, 1e-4);
  EXPECT_NEAR(difference.maxError, 0.1, 1e-6);
  // No structure at all: only the luminance term is left.
  EXPECT_NEAR(difference.ssim, (2 * 0.5 * 0.6 + 1e-4) / (0.25 + 0.36 + 1e-4), 1e-5);
}

TEST(Compare, onlyCoveredPixelsCount) {
  Image a(glm::ivec2(40, 30), 4), b(glm::ivec2(40, 30), 4);
  a.at(3, 4)[1] = 0.3f;    // covered by a alone
  b.at(20, 25)[3] = 1.0f;  // covered by b alone, same colour
  const ImageDifference difference = compareImages(a, b);
  EXPECT_EQ(difference.coveredPixels, 2u);
  EXPECT_NEAR(difference.rms, 0.3 / std::sqrt(6.0), 1e-7);  // one channel of two pixels times three
  EXPECT_EQ(difference.maxError, 1.0);                      // alpha counts here
}

TEST(Compare, blackPicturesAgree) {
  const ImageDifference difference = compareImages(Image({5, 7}, 4), Image({5, 7}, 4));
  EXPECT_TRUE(difference.identical);
  EXPECT_EQ(difference.coveredPixels, 0u);
  EXPECT_EQ(difference.rms, 0.0);
  EXPECT_EQ(difference.ssim, 1.0);
}

TEST(Compare, bitsDecideWhatIsIdentical) {
  Image a(glm::ivec2(2, 3), 6), b(glm::ivec2(2, 3), 6);
  a.at(1, 2)[5] = 0.0f;
  b.at(1, 2)[5] = -0.0f;
  const ImageDifference difference = compareImages(a, b);
  EXPECT_FALSE(difference.identical);
  EXPECT_EQ(difference.differingBytes, 1u);
  EXPECT_EQ(difference.maxError, 0.0);
}

TEST(Compare, aNanIsAnInfiniteDifference) {
  Image a = uniform({9, 9}, 0.5f);
  a.at(4, 4)[0] = NAN;
  const ImageDifference same = compareImages(a, a);
  EXPECT_TRUE(same.identical);
  EXPECT_EQ(same.maxError, INFINITY);
  const ImageDifference other = compareImages(a, uniform({9, 9}, 0.5f));
  EXPECT_FALSE(other.identical);
  EXPECT_EQ(other.maxError, INFINITY);
  EXPECT_EQ(other.psnr, -INFINITY);
  EXPECT_LT(other.ssim, 1.0);
}

TEST(Compare, structureLostShowsInSsim) {
  Image checks(glm::ivec2(32, 24), 4), grey = uniform({32, 24}, 0.5f);
  for (int y = 0; y < 24; ++y) {
    for (int x = 0; x < 32; ++x) {
      for (int c = 0; c < 4; ++c)
        checks.at(x, y)[c] = float((x + y) % 2);
    }
  }
  EXPECT_LT(compareImages(checks, grey).ssim, 0.01);
  EXPECT_NEAR(compareImages(checks, checks).ssim, 1.0, 1e-12);
}

TEST(Compare, refusesUnequalShapes) {
  EXPECT_THROW(compareImages(Image({5, 7}, 4), Image({7, 5}, 4)), InputError);
  EXPECT_THROW(compareImages(Image({5, 7}, 4), Image({5, 7}, 6)), InputError);
  EXPECT_THROW(differenceImage(Image({5, 7}, 4), Image({5, 8}, 4), 1.0f), InputError);
}

TEST(DifferenceImage, scalesAndIsOpaque) {
  const Image picture = differenceImage(uniform({3, 2}, 0.5f), uniform({3, 2}, 0.25f), 2.0f);
  EXPECT_EQ(picture.at(2, 1)[0], 0.5f);
  EXPECT_EQ(picture.at(2, 1)[2], 0.5f);
  EXPECT_EQ(picture.at(2, 1)[3], 1.0f);
}

}  // namespace
}  // namespace freevoxel
