// What a library does wrong, told in one line.
#include <gtest/gtest.h>

#include "base/address_sanitizer.h"
#include "base/error.h"
#include "tests/support/test_data.h"
#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

class ChildReader : public testing::Test {
 protected:
  static std::string error(const std::string& name) {
    const std::string path = fileOf("anything", name);
    const std::string text = inputError([&] { readVolume(path); });
    EXPECT_EQ(text.substr(0, path.size() + 2), path + ": ");
    return text.substr(std::min(text.size(), path.size() + 2));
  }
  TestReader reader;
};

}  // namespace

TEST_F(ChildReader, aLibraryThatDies) {
  const std::string text = error("a.die.vdb");
  EXPECT_NE(text.find("the library that reads OpenVDB files died of signal 11"), std::string::npos) << text;
  EXPECT_NE(text.find("(it said: the library is unhappy)"), std::string::npos) << text;
}

TEST_F(ChildReader, aLibraryThatHangs) {
  childProgram().limits.silentSeconds = 1;
  EXPECT_EQ(error("a.hang.vdb"), "the library that reads OpenVDB files hangs: nothing came for 1 seconds");
}

TEST_F(ChildReader, aLibraryThatNeverEnds) {
  EXPECT_NE(error("a.spin.vdb").find("was stopped after"), std::string::npos);
}

TEST_F(ChildReader, aLibraryThatEatsMemory) {
  if (kUnderAddressSanitizer) GTEST_SKIP() << "the address sanitizer's own memory is beyond any limit";
  EXPECT_NE(error("a.eat.vdb").find("needs more than"), std::string::npos);
}

TEST_F(ChildReader, aProcessThatTalksNonsense) {
  EXPECT_EQ(error("a.nonsense.vdb"), "the process that reads OpenVDB files sends nonsense");
}

TEST_F(ChildReader, aProcessThatLeaves) {
  EXPECT_NE(error("a.leave.vdb").find("ended with status 3"), std::string::npos);
}

TEST_F(ChildReader, aProgramThatIsNotThere) {
  childProgram().path = "/nonexistent/reader";
  EXPECT_THROW(readVolume(fileOf("anything", "a.vdb")), MachineError);
}

TEST_F(ChildReader, damagedVdbFiles) {
  EXPECT_NE(error("a.vdb").find("damaged or cut short"), std::string::npos);
  if (!dataFolder()) GTEST_SKIP() << kNoData;
  const std::string whole = readBytes(*dataFolder() + "/vdb/sphere.vdb");
  const std::string path = fileOf(whole, "b.vdb");
  for (const size_t part : {1, 4, 7}) {
    writeBytes(path, whole.substr(0, whole.size() * part / 8));
    EXPECT_THROW(readVolume(path), InputError) << part;
  }
  childProgram().limits.silentSeconds = 3;  // OpenVDB may read on for ever
  for (const size_t part : {0, 2, 5}) {
    std::string damaged = whole;
    for (size_t i = 0; i < 8; ++i)
      damaged[std::min(damaged.size() - 1, part * 37 + i)] = char(0xee);
    writeBytes(path, damaged);
    try {
      readVolume(path);
    } catch (const InputError&) {  // anything else fails the test
    } catch (const MachineError&) {
    }
  }
}

}  // namespace freevoxel::test
