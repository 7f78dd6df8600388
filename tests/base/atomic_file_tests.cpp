// Files that appear whole or not at all.
#include "base/atomic_file.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace freevoxel
