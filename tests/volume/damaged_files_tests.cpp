// A tiny file of each format, cut off at every byte, and with bytes changed: read, or refused in one line; nothing
// else.
#include <gtest/gtest.h>

#include <random>

#include "base/address_sanitizer.h"
#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/library_outcomes.h"
#include "tests/volume/tiny_files.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

// Built twice: for every day, and thoroughly for scripts/test_full.sh.
#ifdef FREEVOXEL_THOROUGH
constexpr size_t kChanges = 5000;
constexpr size_t kMostLengths = 1000000;
#else
constexpr size_t kChanges = 60;
constexpr size_t kMostLengths = kUnderAddressSanitizer ? 400 : 1200;  // there each takes some 30 ms
#endif

/// Lengths to cut a file of `size` bytes to: all, or evenly spread with the last 40, and the whole one last.
std::vector<size_t> lengthsOf(size_t size) {
  const size_t step = size / kMostLengths + 1;
  std::vector<size_t> lengths;
  for (size_t length = 0; length <= size; length += length + 40 < size ? step : 1)
    lengths.push_back(length);
  return lengths;
}

/// One to four bytes changed, the same for the same seed; every third time among the first 600 bytes, where headers
/// are.
std::string changed(const std::string& whole, size_t seed) {
  std::minstd_rand random(unsigned(seed) * 2654435761u + 1);
  std::string bytes = whole;
  const size_t reach = seed % 3 == 0 ? std::min<size_t>(whole.size(), 600) : whole.size();
  for (size_t i = 0, count = 1 + random() % 4; i < count; ++i) {
    constexpr uint8_t kTelling[] = {0, 1, 0x7f, 0x80, 0xff, '9', '-', ' '};
    char& byte = bytes[random() % reach];
    switch (random() % 3) {
      case 0:
        byte = char(uint8_t(byte) ^ 1u << random() % 8);
        break;
      case 1:
        byte = char(kTelling[random() % std::size(kTelling)]);
        break;
      default:
        byte = char(random() % 256);
    }
  }
  return bytes;
}

struct NameOf {
  std::string operator()(const testing::TestParamInfo<TinyFile>& file) const { return file.param.format; }
};

class DamagedFile : public testing::TestWithParam<TinyFile> {};
class DamagedLibraryFile : public testing::TestWithParam<TinyFile> {
 protected:
  const std::string path = temporaryFolder() + "/" + GetParam().fileName;
  const std::string whole = GetParam().bytes;
};

}  // namespace

TEST_P(DamagedFile, everyTruncationIsRefused) {
  const std::string path = fileOf(GetParam().bytes, GetParam().fileName);
  expectTruncationsFail(path, [&] { readVolume(path); });
}

TEST_P(DamagedFile, changedBytesAreReadOrRefused) {
  const std::string path = fileOf(GetParam().bytes, GetParam().fileName);
  size_t refused = 0;
  for (size_t seed = 0; seed < kChanges; ++seed) {
    writeBytes(path, changed(GetParam().bytes, seed));
    try {
      VolumeOptions options;
      options.frame = 0;
      const Volume volume = readVolume(path, options);
      EXPECT_EQ(volume.data.size(), volume.header.bytes());
    } catch (const InputError& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << seed << ": " << error.what();
    }
  }
  EXPECT_GT(refused, 0u);
}

TEST_P(DamagedLibraryFile, isReadWhole) {
  const TestReader reader;
  const Volume volume = readVolume(fileOf(whole, GetParam().fileName));
  EXPECT_EQ(volume.header.dims.x, kDims.x);
  EXPECT_EQ(volume.header.dims.y, kDims.y);
  if (GetParam().format.starts_with("vdb")) expectTestValues(volume, ValueType::f32);
}

TEST_P(DamagedLibraryFile, everyTruncationIsRefused) {
  const std::vector<size_t> lengths = lengthsOf(whole.size());
  const LibraryOutcomes outcomes =
      libraryOutcomes(path, lengths.size(), [&](size_t i) { return whole.substr(0, lengths[i]); });
  EXPECT_EQ(outcomes.each.back(), LibraryOutcome::read) << outcomes.talk;
  // GDCM dies of failed assertions where others return an error; both end in one line.
  for (size_t i = 0; i + 1 < lengths.size(); ++i) {
    EXPECT_TRUE(outcomes.each[i] == LibraryOutcome::refused || outcomes.each[i] == LibraryOutcome::died)
        << "cut to " << lengths[i] << " of " << whole.size() << ": " << int(outcomes.each[i]);
  }
}

TEST_P(DamagedLibraryFile, changedBytesAreReadOrRefused) {
  const LibraryOutcomes outcomes = libraryOutcomes(path, kChanges, [&](size_t seed) { return changed(whole, seed); });
  EXPECT_EQ(outcomes.count(LibraryOutcome::notRun), 0u);
  EXPECT_EQ(outcomes.count(LibraryOutcome::incomplete), 0u);
  EXPECT_GT(outcomes.count(LibraryOutcome::refused), 0u);
  // A library may die of a damaged file, but it should not be the rule.
  EXPECT_LT(outcomes.count(LibraryOutcome::died) + outcomes.count(LibraryOutcome::hung), kChanges / 3) << outcomes.talk;
}

INSTANTIATE_TEST_SUITE_P(Own, DamagedFile, testing::ValuesIn(tinyFiles()), NameOf());
INSTANTIATE_TEST_SUITE_P(Library, DamagedLibraryFile, testing::ValuesIn(tinyLibraryFiles()), NameOf());

}  // namespace freevoxel::test
