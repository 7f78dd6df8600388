// How much tests damage tiny files.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "base/address_sanitizer.h"
#include "tests/volume/tiny_files.h"

namespace freevoxel::test {

// Built twice: for every day, and thoroughly for scripts/test_full.sh.
#ifdef FREEVOXEL_THOROUGH
inline constexpr size_t kChanges = 5000;
inline constexpr size_t kMostLengths = 1000000;
#else
inline constexpr size_t kChanges = 60;
inline constexpr size_t kMostLengths = kUnderAddressSanitizer ? 200 : 1200;  // there each takes some 50 ms
#endif

/// Lengths to cut a file of `size` bytes to: all, or evenly spread with the last 40, and the whole one last.
std::vector<size_t> lengthsOf(size_t size);

/// One to four bytes changed, the same for the same seed; every third time among the first 600 bytes, where headers
/// are.
std::string changed(const std::string& whole, size_t seed);

/// For the names of tests.
struct NameOf {
  std::string operator()(const testing::TestParamInfo<TinyFile>& file) const { return file.param.format; }
};

}  // namespace freevoxel::test
