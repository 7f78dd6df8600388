// Many voxels shaded at a time are shaded as one is, with every instruction set.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <random>
#include <vector>

#include "shaders/shared/voxlink.h"
#include "tests/support/instruction_sets.h"
#include "voxlink/shade_run.h"

namespace freevoxel {
namespace {

struct Shaded {
  ShadingFrame frame;
  std::vector<uint8_t> shares;
  std::vector<ShadingLamp> lamps;
  VoxelRun run{};
  static constexpr size_t kFirst = 7;  // fragment of the run's first voxel

  Shaded(Shading shading, bool directional, size_t count) {
    std::mt19937 random(uint32_t(count) * 2 + (directional ? 1 : 0));
    const auto unit = [&] { return float(random() % 2001) / 1000.0f - 1.0f; };
    run.count = count;
    for (size_t i = 0; i < count; ++i) {
      run.x[i] = float(random() % 50);
      run.y[i] = float(random() % 70);
      run.z[i] = float(random() % 90);
      run.fragments[i] = uint32_t(random());
    }
    frame.shading = shading;
    frame.ambient = 0.15f;
    frame.lengthFromIndex = glm::mat3(1.0f, 0.2f, 0.0f, -0.1f, 1.5f, 0.3f, 0.0f, 0.0f, 2.0f);
    const auto beacon = [&] {
      const glm::vec3 way = glm::normalize(glm::vec3(unit(), unit(), 1.2f));
      return Beacon{directional, directional ? way : 60.0f * way};
    };
    frame.eye = beacon();
    const size_t fragments = kFirst + count;  // nothing behind the last one may be read
    shares.resize(3 * fragments);
    for (uint8_t& share : shares)
      share = uint8_t(random());
    for (size_t n = 0; n < 3; ++n)
      lamps.push_back({beacon(), 0.7f * glm::vec3(1.0f + unit(), 1.0f + unit(), 2.0f), shares.data() + n * fragments});
    // One lamp in the very place of a voxel.
    if (!directional) lamps[0].place = place(count / 2);
    frame.lamps = lamps;
  }

  glm::vec3 place(size_t i) const { return frame.lengthFromIndex * glm::vec3(run.x[i], run.y[i], run.z[i]); }

  /// As base/light.h has it, one voxel at a time.
  glm::vec3 expected(size_t i) const {
    const auto way = [&](const Beacon& beacon) { return beacon.directional ? beacon.place : beacon.place - place(i); };
    glm::vec3 normal, sum(frame.ambient);
    float surface;
    shared::unpackNormal(shared::fragmentNormal(run.fragments[i]), normal.x, normal.y, normal.z, surface);
    for (const ShadingLamp& lamp : lamps) {
      float share = float(lamp.shares[kFirst + i]) / 255.0f;
      const float distance = glm::length(way(lamp)), eyeDistance = glm::length(way(frame.eye));
      if (frame.shading != Shading::none && distance > 0.0f && eyeDistance > 0.0f)
        share *= shadeSurface(frame.shading, normal, surface, way(lamp) / distance, way(frame.eye) / eyeDistance);
      sum += lamp.linear * share;
    }
    return sum;
  }
};

TEST(ShadeRun, ShadesAsOneVoxelIsShaded) {
  for (const Shading shading : {Shading::none, Shading::lambert, Shading::phong}) {
    for (const bool directional : {false, true}) {
      for (const size_t count : {size_t(1), size_t(13), VoxelRun::kMost}) {
        Shaded shaded(shading, directional, count);
        shadeRun(shaded.frame, Shaded::kFirst, shaded.run);
        for (size_t i = 0; i < count; ++i) {
          glm::vec3 found;
          shared::unpackLight(shaded.run.light[i], found.r, found.g, found.b);
          const glm::vec3 expected = shaded.expected(i);
          // Packing loses a 500th of the largest channel.
          const float most = std::max({expected.r, expected.g, expected.b});
          for (int channel = 0; channel < 3; ++channel)
            ASSERT_NEAR(found[channel], expected[channel], 0.0021f * most) << int(shading) << " " << count << " " << i;
        }
      }
    }
  }
}

TEST(ShadeRun, PacksAsTheShaderDoes) {
  VoxelRun run{};
  ShadingFrame frame;
  run.count = 1;
  for (float ambient = 1e-6f; ambient < 1e6f; ambient *= 1.7f) {
    frame.ambient = ambient;
    shadeRun(frame, 0, run);
    EXPECT_EQ(run.light[0], shared::packLight(ambient, ambient, ambient)) << ambient;
  }
}

TEST(ShadeRun, GivesTheSameBytesWithEveryInstructionSet) {
  const std::vector<int64_t> sets = test::instructionSets();
  if (sets.size() < 2) GTEST_SKIP() << "one instruction set only";
  for (const Shading shading : {Shading::lambert, Shading::phong}) {
    Shaded first(shading, false, 311);
    {
      const test::InstructionSet set(sets.front());
      shadeRun(first.frame, Shaded::kFirst, first.run);
    }
    for (const int64_t target : sets) {
      const test::InstructionSet set(target);
      Shaded other(shading, false, 311);
      shadeRun(other.frame, Shaded::kFirst, other.run);
      for (size_t i = 0; i < first.run.count; ++i)
        ASSERT_EQ(other.run.light[i], first.run.light[i]) << target << " " << i;
    }
  }
}

}  // namespace
}  // namespace freevoxel
