#include "volume/volume.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/volume/volume_files.h"

namespace freevoxel::test {

namespace {

template <class T>
Volume volumeOf(ValueType type, const std::vector<T>& values) {
  Volume volume;
  volume.header.dims = glm::ivec3(int(values.size()), 1, 1);
  volume.header.type = type;
  volume.data.resize(values.size() * sizeof(T));
  std::memcpy(volume.data.data(), values.data(), volume.data.size());
  return volume;
}

}  // namespace

TEST(Volume, typesHaveTheirNamesAndSizes) {
  const std::vector<std::pair<std::string, size_t>> expected{{"u8", 1},  {"i8", 1},  {"u16", 2}, {"i16", 2},
                                                             {"u32", 4}, {"i32", 4}, {"f32", 4}, {"f64", 8}};
  for (size_t i = 0; i < kAllTypes.size(); ++i) {
    EXPECT_EQ(valueTypeName(kAllTypes[i]), expected[i].first);
    EXPECT_EQ(bytesPerValue(kAllTypes[i]), expected[i].second);
    EXPECT_EQ(isFloatingPoint(kAllTypes[i]), expected[i].first[0] == 'f');
  }
}

TEST(Volume, statisticsLeaveOutWhatIsNotFinite) {
  const float infinity = std::numeric_limits<float>::infinity();
  const ValueStatistics statistics =
      valueStatistics(volumeOf<float>(ValueType::f32, {NAN, -2.0f, infinity, 5.5f, -infinity, 0.25f}));
  EXPECT_EQ(statistics.low, -2.0);
  EXPECT_EQ(statistics.high, 5.5);
  EXPECT_EQ(statistics.sum, 3.75);
  EXPECT_EQ(statistics.nonFinite, 3u);
}

TEST(Volume, statisticsOfNothingFiniteAreZero) {
  const ValueStatistics statistics = valueStatistics(volumeOf<double>(ValueType::f64, {NAN, NAN}));
  EXPECT_EQ(statistics.low, 0.0);
  EXPECT_EQ(statistics.high, 0.0);
  EXPECT_EQ(statistics.sum, 0.0);
  EXPECT_EQ(statistics.nonFinite, 2u);
}

TEST(Volume, sumsOfIntegersAreExact) {
  const size_t count = 3 * (size_t(1) << 18) + 17;  // several chunks and a rest
  const ValueStatistics large =
      valueStatistics(volumeOf<uint32_t>(ValueType::u32, std::vector<uint32_t>(count, 4294967295u)));
  EXPECT_EQ(large.sum, 4294967295.0 * double(count));
  const ValueStatistics negative =
      valueStatistics(volumeOf<int32_t>(ValueType::i32, std::vector<int32_t>(count, -2147483647 - 1)));
  EXPECT_EQ(negative.sum, -2147483648.0 * double(count));
  EXPECT_EQ(negative.high, -2147483648.0);
}

TEST(Volume, statisticsDoNotDependOnThreads) {
  std::vector<float> values(1500000);
  for (size_t i = 0; i < values.size(); ++i)
    values[i] = float(i % 1013) * 0.37f - 100.0f;
  const Volume volume = volumeOf<float>(ValueType::f32, values);
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const double one = valueStatistics(volume).sum;
  omp_set_num_threads(3);
  const double three = valueStatistics(volume).sum;
  omp_set_num_threads(threads);
  EXPECT_EQ(one, three);
}

}  // namespace freevoxel::test
