#include "gl/context.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "base/error.h"
#include "gl/objects.h"

namespace freevoxel::gl {
namespace {

TEST(Context, NamesItsRenderer) {
  Context context;
  EXPECT_FALSE(context.renderer().empty());
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  EXPECT_GE(major * 10 + minor, 45);
  EXPECT_TRUE(context.takeErrors().empty());
}

TEST(Context, CollectsWhatTheDriverReports) {
  Context context;
  glBindFramebuffer(GL_FRAMEBUFFER, 4711);  // a name that no one made
  EXPECT_FALSE(context.takeErrors().empty());
  EXPECT_TRUE(context.takeErrors().empty()) << "taken once";
}

TEST(Context, CanBeMadeAgainAfterItsEnd) {
  for (int round = 0; round < 3; ++round) {
    Context context;
    const Texture2D texture(GL_R32F, {3, 5});
    EXPECT_NE(texture.id(), 0u);
    EXPECT_TRUE(context.takeErrors().empty());
  }
}

TEST(Objects, MoveLeavesTheSourceEmpty) {
  Context context;
  Buffer a(64);
  const GLuint id = a.id();
  Buffer b(std::move(a));
  EXPECT_EQ(a.id(), 0u);  // NOLINT(bugprone-use-after-move): that is what is tested
  EXPECT_EQ(b.id(), id);
  EXPECT_EQ(b.bytes(), 64u);
  EXPECT_TRUE(context.takeErrors().empty());
}

TEST(Objects, TexturesStartAtZero) {
  Context context;
  const Texture2D texture(GL_RGBA32F, {7, 3});
  std::vector<float> texels(7 * 3 * 4, 1.0f);
  glGetTextureImage(texture.id(), 0, GL_RGBA, GL_FLOAT, GLsizei(texels.size() * sizeof(float)), texels.data());
  for (const float texel : texels)
    EXPECT_EQ(texel, 0.0f);
  EXPECT_TRUE(context.takeErrors().empty());
}

TEST(Objects, TooLargeATextureSaysWhatToTry) {
  Context context;
  GLint limit = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &limit);
  try {
    const Texture2D texture(GL_R32F, {limit + 1, 1});
    FAIL() << "no error";
  } catch (const MachineError& error) {
    EXPECT_NE(std::string(error.what()).find("--backend cpu"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace freevoxel::gl
