// Normals and light in few bits.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>

#include "shaders/shared/voxlink.h"

namespace freevoxel {
namespace {

TEST(Arcs, AreWithinTwoMillionths) {
  for (int i = -2000; i <= 2000; ++i) {
    const float x = float(i) / 2000.0f;
    EXPECT_NEAR(shared::arcCosine(x), std::acos(double(x)), 2e-6) << x;
    const float turn = 0.0015707f * float(i);
    const float size = i % 3 == 0 ? 1e-15f : i % 3 == 1 ? 1.0f : 1e15f;
    const float y = size * std::sin(turn);
    EXPECT_NEAR(shared::arcTangent(y, size * std::cos(turn)), turn, 2e-6);
  }
  EXPECT_EQ(shared::arcTangent(0.0f, 1.0f), 0.0f);
  EXPECT_NEAR(shared::arcTangent(1.0f, 0.0f), 1.5707963, 2e-6);
  EXPECT_NEAR(shared::arcTangent(0.0f, -1.0f), 3.1415926, 2e-6);
}

// Polar angles are 180 / 127 degrees apart, azimuths 360 / 128: at most 0.71 and 1.41 degrees are lost.
TEST(PackedNormal, IsWithinTwoDegrees) {
  double worst = 1.0;
  for (int i = 0; i < 5000; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / 5000.0, turn = 2.399963 * i, r = std::sqrt(1.0 - z * z);
    const glm::vec3 normal(r * std::cos(turn), r * std::sin(turn), z);
    glm::vec3 back;
    float surface = 0.0f;
    // Any length will do.
    const float length = i % 2 == 0 ? 1e-12f : 3e7f;
    shared::unpackNormal(
        shared::packNormal(length * normal.x, length * normal.y, length * normal.z, 5.0f / (length * length)), back.x,
        back.y, back.z, surface);
    worst = std::min(worst, double(glm::dot(normal, back)));
    EXPECT_EQ(surface, 1.0f);
    EXPECT_NEAR(glm::length(back), 1.0, 1e-5);
  }
  EXPECT_GT(worst, std::cos(1.6 * 3.14159 / 180.0));
}

TEST(PackedNormal, StrengthHasFourLevels) {
  for (const float strength : {0.1f, 0.3f, 0.5f, 0.8f, 1.0f, 9.0f}) {
    float x, y, z, surface;
    shared::unpackNormal(shared::packNormal(0.0f, 1.0f, 0.0f, strength * strength), x, y, z, surface);
    EXPECT_NEAR(surface, std::min(strength, 1.0f), 1.0f / 6.0f + 1e-6f);
  }
  EXPECT_EQ(shared::packNormal(0.0f, 0.0f, 0.0f, 1.0f), 0u) << "no gradient";
}

TEST(PackedLight, LosesAtMostAFiveHundredthOfTheLargestChannel) {
  for (const float scale : {1e-4f, 0.01f, 0.1f, 0.5f, 0.9999f, 1.0f, 1.001f, 3.0f, 31.9f, 1000.0f, 30000.0f}) {
    for (const glm::vec3 share :
         {glm::vec3(1.0f, 0.5f, 0.25f), glm::vec3(0.0f, 1.0f, 0.01f), glm::vec3(0.3f, 0.9f, 1.0f)}) {
      const glm::vec3 light = scale * share;
      glm::vec3 back;
      shared::unpackLight(shared::packLight(light.r, light.g, light.b), back.r, back.g, back.b);
      for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(back[channel], light[channel], scale * 0.00201f + 1e-6f) << scale << " " << channel;
    }
  }
  float r, g, b;
  shared::unpackLight(shared::packLight(0.0f, 0.0f, 0.0f), r, g, b);
  EXPECT_EQ(r + g + b, 0.0f);
  shared::unpackLight(shared::packLight(1e9f, 0.0f, 0.0f), r, g, b);
  EXPECT_GE(r, 30000.0f);
}

}  // namespace
}  // namespace freevoxel
