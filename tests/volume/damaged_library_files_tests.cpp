// The same of formats that libraries read: a library may die of a damaged file, but no file is read in part.
#include <gtest/gtest.h>

#include "base/error.h"
#include "tests/volume/damaged_library_file.h"
#include "tests/volume/library_outcomes.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

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

}  // namespace freevoxel::test
