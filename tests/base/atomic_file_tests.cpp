// Files that appear whole or not at all.
#include "base/atomic_file.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <utility>

#include "base/error.h"
#include "base/mapped_file.h"
#include "tests/support/test_data.h"

namespace freevoxel {
namespace {

std::span<const std::byte> asBytes(const std::string& text) {
  return std::as_bytes(std::span(text));
}

using Names = std::vector<std::string>;

TEST(AtomicFile, appearsOnlyWithCommit) {
  const std::string folder = test::temporaryFolder();
  const std::string path = folder + "/out.fvx";
  {
    AtomicFile file(path);
    file.reserve(9);
    file.writeAt(4, asBytes("voxel"));
    file.writeAt(0, asBytes("free"));
    EXPECT_FALSE(std::filesystem::exists(path));
    EXPECT_TRUE(file.temporaryPath().ends_with(".fvx"));
    file.commit();
  }
  EXPECT_EQ(test::readBytes(path), "freevoxel");
  EXPECT_EQ(test::listFolder(folder), Names{"out.fvx"});
}

TEST(AtomicFile, leavesTheOldFileAndNothingElseWithoutCommit) {
  const std::string folder = test::temporaryFolder();
  const std::string path = folder + "/out.fvx";
  test::writeBytes(path, "old");
  {
    AtomicFile file(path);
    file.writeAt(0, asBytes("new and longer"));
    const AtomicFile moved(std::move(file));
    EXPECT_EQ(test::listFolder(folder).size(), 2u);
  }
  EXPECT_EQ(test::readBytes(path), "old");
  EXPECT_EQ(test::listFolder(folder), Names{"out.fvx"});
}

/// A name as a run that was killed would have left it.
TEST(AtomicFile, removesWhatDeadRunsLeft) {
  const std::string folder = test::temporaryFolder();
  const Names others = {".out.fvx",
                        ".out.partial-abc.fvx",
                        ".out.partial-abcDE1.exr",
                        ".out.partial-abc+E1.fvx",
                        ".other.partial-abcDE1.fvx",
                        "out.partial-abcDE1.fvx",
                        ".partial-abcDE1.fvx"};
  for (const std::string& name : others)
    test::writeBytes(folder + "/" + name, "not ours");
  test::writeBytes(folder + "/.out.partial-abcDE1.fvx", "left behind");
  test::writeBytes(folder + "/..out.partial-abcDE1.partial-ABCde2.fvx", "left behind by a file with a temporary name");
  std::filesystem::create_directory(folder + "/.out.partial-folder.fvx");
  { const AtomicFile file(folder + "/out.fvx"); }
  Names expected = others;
  expected.push_back(".out.partial-folder.fvx");
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(test::listFolder(folder), expected);
}

TEST(AtomicFile, leavesTheTemporaryFilesOfTheLiving) {
  const std::string folder = test::temporaryFolder();
  AtomicFile first(folder + "/out.fvx");
  AtomicFile second(folder + "/out.fvx");
  const AtomicFile inside(second.temporaryPath());
  EXPECT_EQ(test::listFolder(folder).size(), 3u);
  first.writeAt(0, asBytes("first"));
  first.commit();
  second.writeAt(0, asBytes("second"));
  second.commit();
  EXPECT_EQ(test::readBytes(folder + "/out.fvx"), "second");
}

TEST(AtomicFile, movesBytesDown) {
  const std::string path = test::temporaryFolder() + "/out.fvx";
  std::string bytes(3 << 20, '\0');
  for (size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = char(i * 2654435761u >> 24);
  AtomicFile file(path);
  file.writeAt(1000, asBytes(bytes));
  file.moveDown(1000, 7, bytes.size());
  file.moveDown(7, 7, bytes.size());
  file.truncate(7 + bytes.size());
  file.sync();
  file.commit();
  EXPECT_TRUE(test::readBytes(path) == std::string(7, '\0') + bytes);
}

TEST(AtomicFile, refusesFoldersThatAreNotThere) {
  const std::string folder = test::temporaryFolder();
  EXPECT_THROW(AtomicFile(folder + "/missing/out.fvx"), MachineError);
  EXPECT_THROW(AtomicFile{folder}, MachineError);
}

TEST(AtomicFile, refusesMoreThanTheDiskHolds) {
  const std::string folder = test::temporaryFolder();
  {
    AtomicFile file(folder + "/out.fvx");
    EXPECT_THROW(file.reserve(uint64_t(1) << 62), MachineError);
  }
  EXPECT_EQ(test::listFolder(folder), Names{});
}

TEST(MappedFile, showsTheBytesOfAFile) {
  const std::string path = test::temporaryFolder() + "/bytes";
  test::writeBytes(path, "freevoxel");
  MappedFile file(path);
  const MappedFile moved(std::move(file));
  ASSERT_EQ(moved.bytes().size(), 9u);
  EXPECT_EQ(std::memcmp(moved.bytes().data(), "freevoxel", 9), 0);
}

TEST(MappedFile, anEmptyFileHasNoBytes) {
  const std::string path = test::temporaryFolder() + "/empty";
  test::writeBytes(path, "");
  EXPECT_TRUE(MappedFile(path).bytes().empty());
}

TEST(MappedFile, refusesWhatIsNoFile) {
  const std::string folder = test::temporaryFolder();
  EXPECT_THROW(MappedFile{folder}, InputError);
  EXPECT_THROW(MappedFile(folder + "/missing"), InputError);
}

/// How a file is cut while it is mapped: to nothing, in the middle, in its last page.
class CutFile : public testing::TestWithParam<size_t> {};
constexpr size_t kUncut = 5 * 4096 + 1000;
INSTANTIATE_TEST_SUITE_P(Lengths, CutFile, testing::Values(0, 2 * 4096, 2 * 4096 + 5, kUncut - 1));

TEST_P(CutFile, readsAsZerosAndIsTold) {
  const std::string path = test::temporaryFolder() + "/bytes";
  test::writeBytes(path, std::string(kUncut, 'x'));
  MappedFile file(path);
  file.guard();
  MappedFile moved(std::move(file));
  moved.checkIntact();
  std::filesystem::resize_file(path, GetParam());
  for (size_t i = 0; i < kUncut; ++i)
    ASSERT_EQ(moved.bytes()[i], std::byte(i < GetParam() ? 'x' : 0)) << i;
  EXPECT_THROW(moved.checkIntact(), InputError);
}

TEST(MappedFile, aFileCutForAMomentIsToldOf) {
  const std::string path = test::temporaryFolder() + "/bytes";
  test::writeBytes(path, std::string(kUncut, 'x'));
  MappedFile file(path);
  file.guard();
  std::filesystem::resize_file(path, 4096);
  EXPECT_EQ(file.bytes()[3 * 4096], std::byte(0));
  std::filesystem::resize_file(path, kUncut);
  EXPECT_THROW(file.checkIntact(), InputError);
}

TEST(MappedFile, guardsEndWithTheirFiles) {
  const std::string path = test::temporaryFolder() + "/bytes";
  test::writeBytes(path, std::string(kUncut, 'x'));
  for (int i = 0; i < 200; ++i) {
    MappedFile file(path);
    file.guard();
  }
  MappedFile file(path);
  file.guard();
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ(file.bytes()[0], std::byte(0));
}

/// A bus error elsewhere is still one.
TEST(MappedFileDeathTest, otherBusErrorsEndTheProgram) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const std::string path = test::temporaryFolder() + "/bytes";
  test::writeBytes(path, std::string(kUncut, 'x'));
  MappedFile guarded(path);
  guarded.guard();
  const MappedFile unguarded(path);
  std::filesystem::resize_file(path, 0);
  EXPECT_DEATH(EXPECT_EQ(unguarded.bytes()[0], std::byte(1)), "");
}

TEST(AtomicFile, KnowsTheNamesOfItsTemporaryFiles) {
  const std::string folder = test::temporaryFolder();
  const AtomicFile file(folder + "/a.fvx");
  EXPECT_TRUE(isTemporaryName(file.temporaryPath()));
  const AtomicFile nested(file.temporaryPath());
  EXPECT_TRUE(isTemporaryName(nested.temporaryPath()));
  for (const char* name : {"a.fvx", ".a.fvx", "a.partial-abcdef.fvx", ".a.partial-abc.fvx", ""})
    EXPECT_FALSE(isTemporaryName(folder + "/" + name)) << name;
}

}  // namespace
}  // namespace freevoxel
