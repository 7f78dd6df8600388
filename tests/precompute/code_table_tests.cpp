// Tables looked up row by row, against single entries.
#include "precompute/code_table.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "tests/precompute/instruction_sets.h"

namespace freevoxel {
namespace {

/// Rows shorter, equal to and longer than what is looked up at once, at odd addresses, one after another.
TEST(CodeTable, rowsAreLookedUpLikeSingleCodes) {
  constexpr size_t kRows = 3, kGap = 2;
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
      for (size_t width = 0; width < 200; ++width) {
        std::vector<uint16_t> codes(1 + kRows * width);
        for (uint16_t& code : codes)
          code = uint16_t(random() % size);
        const CodeRows rows{codes.data() + 1, width, kRows, ptrdiff_t(random() % 100)};
        const size_t stride = width + kGap, count = 1 + kRows * stride;
        std::vector<uint32_t> foundNumbers(count, 1234u);
        std::vector<float> foundFloats(count, 1234.0f), converted(count, 0.5f);
        numberTable.lookUp(rows, foundNumbers.data() + 1, stride);
        floatTable.lookUp(rows, foundFloats.data() + 1, stride);
        codesAsFloats(rows, converted.data() + 1, stride);
        for (size_t i = 0; i < count; ++i) {
          const size_t row = (i - 1) / stride, x = (i - 1) % stride;
          if (i == 0 || x >= width) {
            ASSERT_EQ(foundNumbers[i], 1234u) << "beside the rows";
            ASSERT_EQ(foundFloats[i], 1234.0f);
            ASSERT_EQ(converted[i], 0.5f);
            continue;
          }
          const uint16_t code = codes[1 + row * width + x];
          ASSERT_EQ(foundNumbers[i], numbers[code]);
          ASSERT_EQ(foundFloats[i], floats[code]);
          ASSERT_EQ(converted[i], float(code));
        }
      }
    }
  }
}

}  // namespace
}  // namespace freevoxel
