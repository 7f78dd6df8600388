// A tiny file of each format that our parsers read, cut off at every byte, and with bytes changed: read, or refused in
// one line; nothing else.
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/damage.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

class DamagedFile : public testing::TestWithParam<TinyFile> {};

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

INSTANTIATE_TEST_SUITE_P(Own, DamagedFile, testing::ValuesIn(tinyFiles()), NameOf());

}  // namespace freevoxel::test
