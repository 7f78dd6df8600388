#include "volume/stored_values.h"

#include <gtest/gtest.h>

#include <cmath>

namespace freevoxel::test {

TEST(StoredValues, halves) {
  EXPECT_EQ(floatFromHalf(0x3c00), 1.0f);
  EXPECT_EQ(floatFromHalf(0xc000), -2.0f);
  EXPECT_EQ(floatFromHalf(0x7bff), 65504.0f);
  EXPECT_EQ(floatFromHalf(0x0001), 0x1p-24f);
  EXPECT_EQ(floatFromHalf(0x0400), 0x1p-14f);
  EXPECT_EQ(floatFromHalf(0x8000), 0.0f);
  EXPECT_TRUE(std::signbit(floatFromHalf(0x8000)));
  EXPECT_TRUE(std::isinf(floatFromHalf(0xfc00)));
  EXPECT_TRUE(std::isnan(floatFromHalf(0x7e01)));
}

TEST(StoredValues, oneOfSeveralScaled) {
  const uint8_t stored[] = {1, 0, 2, 9, 9, 9, 0, 3, 4, 9, 9, 9};  // big-endian u16 triples: 1, 521, 2313; 3, ...
  float kept[2];
  convertValues(std::as_bytes(std::span(stored)), StoredType::u16, ByteOrder::big, {3, 0}, {2.0, -1.0}, ValueType::f32,
                std::as_writable_bytes(std::span(kept)));
  EXPECT_EQ(kept[0], 511.0f);
  EXPECT_EQ(kept[1], 5.0f);
  uint16_t second[2];
  convertValues(std::as_bytes(std::span(stored)), StoredType::u16, ByteOrder::big, {3, 1}, {}, ValueType::u16,
                std::as_writable_bytes(std::span(second)));
  EXPECT_EQ(second[0], 0x0209);
  EXPECT_EQ(second[1], 0x0409);
}

}  // namespace freevoxel::test
