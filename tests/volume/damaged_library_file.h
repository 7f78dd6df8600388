// Tests that damage a tiny file of a format that a library reads (damaged_library_files_tests.cpp); instantiated where
// such files are made.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/support/test_data.h"
#include "tests/volume/damage.h"

namespace freevoxel::test {

class DamagedLibraryFile : public testing::TestWithParam<TinyFile> {
 protected:
  const std::string path = temporaryFolder() + "/" + GetParam().fileName;
  const std::string whole = GetParam().bytes;
};

}  // namespace freevoxel::test
