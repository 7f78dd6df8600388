// Pins in attenuation files: what was added comes back, and nothing that is damaged or lies is believed.
#include "hierarchy/pinned_planes.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "hierarchy/attenuation_file.h"
#include "precompute/checksums.h"
#include "precompute/pin_writer.h"
#include "precompute/precompute.h"
#include "tests/precompute/test_volumes.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

const std::vector<Pin> kPins = {{true, {0.5, -1.0, 0.25}}, {false, {40.0, 3.0, -7.5}}};

/// Smooth here, noise there, all the same in between.
std::vector<uint16_t> attenuationOf(glm::ivec3 dims, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<uint16_t> values;
  for (int z = 0; z < dims.z; ++z) {
    for (int y = 0; y < dims.y; ++y) {
      for (int x = 0; x < dims.x; ++x)
        values.push_back(z < 8 ? uint16_t(900 * x + 17 * y) : y < 8 ? uint16_t(random()) : uint16_t(1234 + seed));
    }
  }
  return values;
}

std::string plainFile(glm::ivec3 dims, Layout layout, int edge) {
  const std::string path = test::temporaryFolder() + "/plain.fvx";
  precompute(test::randomBytes(dims, 51), test::veilAndRamp(), path, {Classification::voxel, layout, edge, "by a test"},
             test::silentProgress());
  return path;
}

std::string pinnedFile(glm::ivec3 dims, Layout layout, int edge) {
  const std::string path = test::temporaryFolder() + "/pinned.fvx";
  PinWriter writer(plainFile(dims, layout, edge), path, kPins);
  for (size_t pin = 0; pin < kPins.size(); ++pin)
    writer.add(attenuationOf(dims, uint32_t(pin)));
  const uint64_t bytes = writer.commit();
  EXPECT_EQ(bytes, std::filesystem::file_size(path));
  return path;
}

std::string pinComplaint(const std::string& path) {
  try {
    AttenuationFile(path).verify();
    return {};
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
    return error.what();
  }
}

using Shape = std::tuple<glm::ivec3, Layout, int>;
class Pinned : public testing::TestWithParam<Shape> {};
INSTANTIATE_TEST_SUITE_P(Shapes, Pinned,
                         testing::Values(Shape({1, 1, 1}, Layout::dense, 8), Shape({5, 7, 11}, Layout::dense, 8),
                                         Shape({17, 9, 33}, Layout::compact, 16),
                                         Shape({40, 9, 24}, Layout::dense, 32)));

TEST_P(Pinned, comesBackAsItWasAdded) {
  const auto [dims, layout, edge] = GetParam();
  const AttenuationFile file(pinnedFile(dims, layout, edge));
  file.verify();
  ASSERT_EQ(file.pinned().pins().size(), 2u);
  EXPECT_TRUE(file.pinned().pins()[0].directional);
  EXPECT_EQ(file.pinned().pins()[0].world, kPins[0].world);
  EXPECT_FALSE(file.pinned().pins()[1].directional);
  EXPECT_EQ(file.pinned().pins()[1].world, kPins[1].world);
  std::vector<uint16_t> values(size_t(edge) * size_t(edge) * size_t(edge));
  const glm::ivec3 bricks = (dims + (edge - 1)) / edge;
  for (uint32_t pin = 0; pin < 2; ++pin) {
    const std::vector<uint16_t> expected = attenuationOf(dims, pin);
    for (int b = 0; b < bricks.x * bricks.y * bricks.z; ++b) {
      const glm::ivec3 position(b % bricks.x, b / bricks.x % bricks.y, b / (bricks.x * bricks.y));
      file.pinned().unpack(pin, position, values);
      const auto curve = hilbertCurve(hilbertState(position, hilbertOrder(bricks)), hilbertOrder(glm::ivec3(edge)));
      for (size_t step = 0; step < curve.size(); ++step) {
        const glm::ivec3 p = position * edge + glm::ivec3(curve[step].x, curve[step].y, curve[step].z);
        if (p.x < dims.x && p.y < dims.y && p.z < dims.z) {
          ASSERT_EQ(values[step], expected[linearIndex(p, dims)]) << p.x << " " << p.y << " " << p.z;
        }
      }
    }
  }
}

TEST_P(Pinned, everythingElseStaysByteForByte) {
  const auto [dims, layout, edge] = GetParam();
  const AttenuationFile plain(plainFile(dims, layout, edge));
  const AttenuationFile pinned(pinnedFile(dims, layout, edge));
  ASSERT_EQ(plain.brickCount(), pinned.brickCount());
  EXPECT_EQ(plain.command(), pinned.command());
  EXPECT_EQ(plain.codeBytes(), pinned.codeBytes());
  EXPECT_TRUE(plain.pinned().pins().empty());
  for (size_t i = 0; i < plain.brickCount(); ++i) {
    const BrickView a = plain.brick(i), b = pinned.brick(i);
    EXPECT_EQ(a.hilbertIndex, b.hilbertIndex);
    EXPECT_EQ(std::memcmp(a.codes, b.codes, a.curve.size()), 0);
    for (size_t k = 0; k < 26; ++k)
      EXPECT_EQ(std::memcmp(a.attenuations[k], b.attenuations[k], a.curve.size()), 0);
  }
}

/// Sections as docs/format.md draws them, changed and sealed again.
struct PinForgery {
  std::string bytes;

  size_t entry(const std::string& type) const {
    for (size_t at = 32;; at += 40) {
      if (bytes.substr(at, 4) == type) return at;
    }
  }
  template <class T>
  T at(size_t offset) const {
    T value;
    std::memcpy(&value, bytes.data() + offset, sizeof(T));
    return value;
  }
  template <class T>
  void set(size_t offset, const T& value) {
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
  }
  size_t section(const std::string& type) const { return at<uint64_t>(entry(type) + 8); }

  /// With the right checksums of the header and, if there, of the pins' sections.
  void seal() {
    const auto header = at<FileHeader>(0);
    std::vector<SectionEntry> sections(header.sectionCount);
    std::memcpy(sections.data(), bytes.data() + 32, sections.size() * sizeof(SectionEntry));
    for (SectionEntry& section : sections) {
      if (section.type != section::kPins && section.type != section::kPinFrames && section.type != section::kPackedPins)
        continue;
      section.hash = contentHash(std::as_bytes(std::span(bytes)).subspan(section.offset, section.bytes));
    }
    std::memcpy(bytes.data() + 32, sections.data(), sections.size() * sizeof(SectionEntry));
    set<uint64_t>(24, headerHash(header, sections));
  }
  std::string complaintWhenSealed() {
    seal();
    const std::string path = test::temporaryFolder() + "/forged.fvx";
    test::writeBytes(path, bytes);
    return pinComplaint(path);
  }
};

class ForgedPins : public testing::Test {
 protected:
  const std::string whole = test::readBytes(pinnedFile({9, 12, 20}, Layout::compact, 8));

  template <class Change>
  void expectRefused(const std::string& what, Change&& change) {
    PinForgery forgery{whole};
    change(forgery);
    const std::string found = forgery.complaintWhenSealed();
    EXPECT_NE(found.find(what), std::string::npos) << "expected '" << what << "', found '" << found << "'";
  }
};

TEST_F(ForgedPins, mayBeSkippedByReadersThatDoNotKnowThem) {
  PinForgery forgery{whole};
  EXPECT_EQ(forgery.complaintWhenSealed(), "");
  for (const char* type : {"PINS", "PFRM", "ZPIN"})
    EXPECT_EQ(forgery.at<uint32_t>(forgery.entry(type) + 4), kSectionOptional);
  // To a reader that knows none of these they are three sections that it may skip.
  for (const auto& [type, other] : {std::pair("PINS", "XPIN"), std::pair("PFRM", "XFRM"), std::pair("ZPIN", "XZPI")})
    forgery.bytes.replace(forgery.entry(type), 4, other);
  EXPECT_EQ(forgery.complaintWhenSealed(), "");
}

TEST_F(ForgedPins, entriesThatMakeNoSense) {
  expectRefused("kind 0 or 1", [](PinForgery& f) { f.set<uint32_t>(f.section("PINS"), 2); });
  expectRefused("reserved", [](PinForgery& f) { f.set<uint32_t>(f.section("PINS") + 4, 1); });
  const double bad[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  for (const double number : bad)
    expectRefused("finite numbers", [&](PinForgery& f) { f.set<double>(f.section("PINS") + 32 + 16, number); });
  expectRefused("not all 0", [](PinForgery& f) {
    for (size_t i = 0; i < 3; ++i)
      f.set<double>(f.section("PINS") + 8 + 8 * i, 0.0);
  });
}

TEST_F(ForgedPins, countsThatDoNotFit) {
  constexpr uint64_t kHuge = ~uint64_t(0);
  for (const char* type : {"PINS", "PFRM", "ZPIN"}) {
    for (const uint64_t items : {uint64_t(0), uint64_t(1), uint64_t(3), kHuge})
      expectRefused(type, [&](PinForgery& f) { f.set<uint64_t>(f.entry(type) + 24, items); });
    expectRefused(type, [&](PinForgery& f) { f.bytes.replace(f.entry(type), 4, "GONE"); });
  }
}

TEST_F(ForgedPins, directoryThatLies) {
  const PinForgery right{whole};
  const size_t directory = right.section("PFRM");
  const auto bricks = size_t(right.at<uint64_t>(right.entry("PFRM") + 24));
  size_t packed = bricks, uniform = bricks;
  for (size_t i = bricks; i-- > 0;)
    (right.at<uint32_t>(directory + 8 * i) > 0 ? packed : uniform) = i;
  ASSERT_LT(packed, bricks);
  ASSERT_LT(uniform, bricks);
  const auto size = right.at<uint32_t>(directory + 8 * packed);
  expectRefused("bytes of ZPIN", [&](PinForgery& f) { f.set<uint32_t>(directory + 8 * packed, size - 1); });
  expectRefused("of frame", [&](PinForgery& f) { f.set<uint32_t>(directory + 8 * packed, 0xffffffffu); });
  expectRefused("of frame", [&](PinForgery& f) { f.set<uint32_t>(directory + 8 * (bricks - 1), 0x7fffffffu); });
  expectRefused("uniform", [&](PinForgery& f) { f.set<uint32_t>(directory + 8 * packed + 4, 1); });
  expectRefused("at most 65535", [&](PinForgery& f) { f.set<uint32_t>(directory + 8 * uniform + 4, 65536); });
}

TEST_F(ForgedPins, framesThatAreNone) {
  expectRefused("prediction", [](PinForgery& f) { f.bytes[f.section("ZPIN")] = 7; });
  expectRefused("zstd", [](PinForgery& f) { f.bytes[f.section("ZPIN") + 1] ^= 1; });
}

TEST(DamagedPins, everyCutAndEveryChangedByteIsFound) {
  const std::string path = pinnedFile({5, 7, 6}, Layout::compact, 8);
  const std::string whole = test::readBytes(path);
  const size_t first = PinForgery{whole}.section("PINS");
  ASSERT_EQ(pinComplaint(path), "");
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  for (size_t at = first; at < whole.size(); ++at) {
    file.seekp(std::streamoff(at)).put(char(whole[at] ^ (1 << at % 8))).flush();
    ASSERT_NE(pinComplaint(path), "") << at;
    file.seekp(std::streamoff(at)).put(whole[at]).flush();
  }
  file.close();
  for (size_t bytes = whole.size(); bytes-- > first;) {
    std::filesystem::resize_file(path, bytes);
    ASSERT_NE(pinComplaint(path), "") << bytes;
  }
}

}  // namespace
}  // namespace freevoxel
