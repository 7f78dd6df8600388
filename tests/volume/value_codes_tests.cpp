#include "volume/value_codes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.h"

namespace freevoxel {

TEST(ValueCodes, integersAreCodedWithoutLoss) {
  const ValueCoding bytes = valueCoding(ValueType::u8, 0.0, 255.0);
  EXPECT_EQ(bytes.bytes(), 1);
  EXPECT_EQ(bytes.largest, 255u);
  for (int v = 0; v < 256; ++v)
    EXPECT_EQ(bytes.decode(bytes.encode(v)), v);

  const ValueCoding signedShorts = valueCoding(ValueType::i16, -1000.0, 3000.0);
  EXPECT_EQ(signedShorts.bytes(), 2);
  EXPECT_EQ(signedShorts.largest, 4000u);
  for (int v = -1000; v <= 3000; ++v)
    EXPECT_EQ(signedShorts.decode(signedShorts.encode(v)), v);
}

TEST(ValueCodes, oneByteUpTo256WholeNumbers) {
  EXPECT_EQ(valueCoding(ValueType::i16, 100.0, 355.0).bytes(), 1);
  EXPECT_EQ(valueCoding(ValueType::i16, 100.0, 356.0).bytes(), 2);
  EXPECT_EQ(valueCoding(ValueType::i32, 0.0, 65535.0).largest, 65535u);
  EXPECT_EQ(valueCoding(ValueType::i32, 0.0, 65535.0).step, 1.0);
  EXPECT_GT(valueCoding(ValueType::i32, 0.0, 65536.0).step, 1.0);
}

TEST(ValueCodes, rangesOfIntegersAreWidenedToWholeNumbers) {
  const ValueCoding coding = valueCoding(ValueType::u8, 0.5, 10.25);
  EXPECT_EQ(coding.low, 0.0);
  EXPECT_EQ(coding.step, 1.0);
  EXPECT_EQ(coding.largest, 11u);
}

TEST(ValueCodes, floatsTake65536Steps) {
  const ValueCoding coding = valueCoding(ValueType::f32, -1.0, 3.0);
  EXPECT_EQ(coding.bytes(), 2);
  EXPECT_EQ(coding.largest, 65535u);
  EXPECT_EQ(coding.encode(-1.0), 0u);
  EXPECT_EQ(coding.encode(3.0), 65535u);
  EXPECT_NEAR(coding.decode(coding.largest), 3.0, 1e-12);
  for (double v = -1.0; v <= 3.0; v += 0.0137)
    EXPECT_NEAR(coding.decode(coding.encode(v)), v, 0.5001 * coding.step);
}

TEST(ValueCodes, whatLiesOutsideGoesToTheEnds) {
  const double infinity = std::numeric_limits<double>::infinity();
  const ValueCoding coding = valueCoding(ValueType::f64, 0.0, 1.0);
  EXPECT_EQ(coding.encode(-0.1), 0u);
  EXPECT_EQ(coding.encode(1.1), 65535u);
  EXPECT_EQ(coding.encode(NAN), 0u);
  EXPECT_EQ(coding.encode(-infinity), 0u);
  EXPECT_EQ(coding.encode(infinity), 65535u);
  EXPECT_EQ(coding.encode(1e300), 65535u);
}

TEST(ValueCodes, hugeRangesDoNotOverflow) {
  const ValueCoding coding = valueCoding(ValueType::f64, -1.7e308, 1.7e308);
  EXPECT_TRUE(std::isfinite(coding.step));
  EXPECT_EQ(coding.encode(-1.7e308), 0u);
  EXPECT_EQ(coding.encode(1.7e308), 65535u);
}

TEST(ValueCodes, anEmptyRangeIsOurBug) {
  EXPECT_THROW(valueCoding(ValueType::f32, 1.0, 1.0), InternalError);
  EXPECT_THROW(valueCoding(ValueType::f32, 0.0, 5e-324), InternalError);
  EXPECT_THROW(valueCoding(ValueType::u8, 0.0, NAN), InternalError);
}

TEST(ValueCodes, volumesAreCodedVoxelByVoxel) {
  Volume volume;
  volume.header.dims = {3, 2, 1};
  volume.header.type = ValueType::i16;
  const int16_t values[] = {-5, 0, 7, 300, -32768, 32767};
  volume.data.resize(sizeof(values));
  std::memcpy(volume.data.data(), values, sizeof(values));
  EXPECT_EQ(encodeValues(volume, valueCoding(ValueType::i16, -5.0, 300.0)),
            (std::vector<uint16_t>{0, 5, 12, 305, 0, 305}));
}

}  // namespace freevoxel
