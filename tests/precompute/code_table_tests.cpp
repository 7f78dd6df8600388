// Tables looked up row by row, against single entries.
#include "precompute/code_table.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/precompute/instruction_sets.h"

namespace freevoxel {
namespace {

/// Rows shorter, equal to and longer than what is looked up at once, at odd addresses.
TEST(CodeTable, rowsAreLookedUpLikeSingleCodes) {
  std::mt19937 random(3);
  for (const size_t size : {1u, 2u, 77u, 255u, 256u, 257u, 4096u, 65536u}) {
    std::vector<uint32_t> numbers(size);
    std::vector<float> floats(size);
    for (size_t i = 0; i < size; ++i) {
      numbers[i] = random();
      floats[i] = float(random()) / 7.0f;
    }
    const CodeTable numberTable(numbers), floatTable(floats);
    for (const int64_t target : test::instructionSets()) {
      const test::InstructionSet chosen(target);
      for (size_t count = 0; count < 200; ++count) {
        std::vector<uint16_t> codes(count + 1);
        for (uint16_t& code : codes)
          code = uint16_t(random() % size);
        const std::span<const uint16_t> row = std::span<const uint16_t>(codes).subspan(1);
        std::vector<uint32_t> foundNumbers(count + 2, 1234u);
        std::vector<float> foundFloats(count + 2, 1234.0f);
        numberTable.row(row, foundNumbers.data() + 1);
        floatTable.row(row, foundFloats.data() + 1);
        std::vector<float> converted(count + 2, 0.5f);
        codesAsFloats(row, converted.data() + 1);
        for (size_t i = 0; i < count; ++i) {
          ASSERT_EQ(foundNumbers[i + 1], numbers[row[i]]);
          ASSERT_EQ(foundFloats[i + 1], floats[row[i]]);
          ASSERT_EQ(converted[i + 1], float(row[i]));
        }
        EXPECT_EQ(foundNumbers.front(), 1234u);
        EXPECT_EQ(foundNumbers.back(), 1234u);
        EXPECT_EQ(foundFloats.front(), 1234.0f);
        EXPECT_EQ(foundFloats.back(), 1234.0f);
        EXPECT_EQ(converted.front(), 0.5f);
        EXPECT_EQ(converted.back(), 0.5f);
      }
    }
  }
}

}  // namespace
}  // namespace freevoxel
