// The sweeps against rays marched one by one, and against closed forms.
#include "precompute/sweep.h"

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <span>
#include <vector>

#include "shaders/shared/directions.h"
#include "tests/precompute/instruction_sets.h"
#include "tests/precompute/test_volumes.h"
#include "volume/value_codes.h"

namespace freevoxel {
namespace {

using test::Planes;
using test::sweepAll;

bool inside(glm::ivec3 p, glm::ivec3 dims) {
  return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < dims.x && p.y < dims.y && p.z < dims.z;
}

/// One ray: fixed-point and exact depth of the way from voxel p to the outside.
struct RayDepth {
  FixedDepth fixed = 0;
  double exact = 0.0;  ///< natural
};
RayDepth marchRay(std::span<const uint16_t> codes, glm::ivec3 dims, glm::ivec3 p, int direction,
                  const TransferFunction& transfer, const ValueCoding& coding) {
  const glm::ivec3 step(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction));
  uint64_t sum = 0;
  RayDepth ray;
  for (p += step; inside(p, dims); p += step) {
    const double extinction = transfer.extinctionAt(coding.decode(codes[linearIndex(p, dims)]));
    sum += fixedDepth(extinction);
    ray.exact += extinction;
  }
  ray.fixed = FixedDepth(std::min<uint64_t>(sum, 0xffffffffu));
  return ray;
}

struct SweepCase {
  glm::ivec3 dims;
  int edge;
};
class Sweep : public testing::TestWithParam<SweepCase> {};
INSTANTIATE_TEST_SUITE_P(Dims, Sweep,
                         testing::Values(SweepCase{{5, 7, 11}, 8}, SweepCase{{1, 1, 1}, 16}, SweepCase{{17, 3, 33}, 16},
                                         SweepCase{{16, 16, 17}, 16}, SweepCase{{1, 9, 2}, 8}, SweepCase{{23, 1, 1}, 8},
                                         SweepCase{{1, 1, 23}, 8}, SweepCase{{2, 3, 64}, 32}, SweepCase{{3, 50, 2}, 16},
                                         SweepCase{{70, 9, 5}, 32}, SweepCase{{33, 37, 20}, 16}));

TEST_P(Sweep, equalsRaysMarchedOneByOne) {
  const auto [dims, edge] = GetParam();
  const Volume volume = test::randomBytes(dims, 11);
  const TransferFunction transfer = test::veilAndRamp();
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  const auto codes = encodeValues(volume, coding);
  const Planes planes = sweepAll(codes, dims, *makeSegmentDepth(Classification::voxel, transfer, coding), edge);
  for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
    for (int z = 0; z < dims.z; ++z) {
      for (int y = 0; y < dims.y; ++y) {
        for (int x = 0; x < dims.x; ++x) {
          const RayDepth ray = marchRay(codes, dims, {x, y, z}, direction, transfer, coding);
          const uint8_t found = planes[size_t(direction)][linearIndex({x, y, z}, dims)];
          ASSERT_EQ(found, attenuationCode(ray.fixed)) << direction << ": " << x << ' ' << y << ' ' << z;
          ASSERT_LE(std::abs(found - std::lround(255.0 * std::exp(-ray.exact))), 1);
        }
      }
    }
  }
}

/// Codes of one byte, or of two: segments follow from them by different rules.
std::array<ValueCoding, 2> codings(const TransferFunction& transfer) {
  return {valueCoding(ValueType::u8, transfer.low, transfer.high), valueCoding(ValueType::u16, transfer.low, 1000.0)};
}

TEST_P(Sweep, preintegratedEqualsSegmentsAddedOneByOne) {
  const auto [dims, edge] = GetParam();
  const Volume volume = test::randomBytes(dims, 12);
  const TransferFunction transfer = test::veilAndRamp();
  for (const ValueCoding& coding : codings(transfer)) {
    const auto codes = encodeValues(volume, coding);
    const auto segments = makeSegmentDepth(Classification::preintegrated, transfer, coding);
    const Planes planes = sweepAll(codes, dims, *segments, edge);
    for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
      const glm::ivec3 step(shared::directionX(direction), shared::directionY(direction),
                            shared::directionZ(direction));
      for (uint64_t i = 0; i < codes.size(); ++i) {
        const glm::ivec3 p(int(i % uint64_t(dims.x)), int(i / uint64_t(dims.x) % uint64_t(dims.y)),
                           int(i / (uint64_t(dims.x) * uint64_t(dims.y))));
        uint64_t sum = 0;
        for (glm::ivec3 q = p; inside(q + step, dims); q += step) {
          FixedDepth depth = 0;
          segments->row({&codes[linearIndex(q, dims)], 1}, {&codes[linearIndex(q + step, dims)], 1}, &depth);
          sum += depth;
        }
        ASSERT_EQ(planes[size_t(direction)][i], attenuationCode(FixedDepth(std::min<uint64_t>(sum, 0xffffffffu))));
      }
    }
  }
}

TEST_P(Sweep, isTheSameForAnyNumberOfThreadsAndAnyInstructionSet) {
  const auto [dims, edge] = GetParam();
  const Volume volume = test::randomBytes(dims, 13);
  const TransferFunction transfer = test::veilAndRamp();
  const int before = omp_get_max_threads();
  for (const ValueCoding& coding : codings(transfer)) {
    const auto codes = encodeValues(volume, coding);
    for (const auto classification : {Classification::voxel, Classification::preintegrated}) {
      const auto segments = makeSegmentDepth(classification, transfer, coding);
      omp_set_num_threads(1);
      const Planes expected = sweepAll(codes, dims, *segments, edge);
      for (const int threads : {2, 3, 8}) {
        omp_set_num_threads(threads);
        for (const int other : {8, 16, 32})
          EXPECT_EQ(sweepAll(codes, dims, *segments, other), expected);
      }
      for (const int64_t target : test::instructionSets()) {
        const test::InstructionSet chosen(target);
        EXPECT_EQ(sweepAll(codes, dims, *segments, edge), expected) << hwy::TargetName(target);
      }
    }
  }
  omp_set_num_threads(before);
}

TEST(SweepMemoryKept, leavesNoTraceInLaterSweeps) {
  const TransferFunction transfer = test::veilAndRamp();
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  SweepMemory memory;
  for (const glm::ivec3 dims : {glm::ivec3(33, 37, 20), glm::ivec3(5, 7, 11), glm::ivec3(70, 9, 5)}) {
    for (const auto classification : {Classification::preintegrated, Classification::voxel}) {
      const auto segments = makeSegmentDepth(classification, transfer, coding);
      for (const uint32_t seed : {16u, 17u}) {
        const auto codes = encodeValues(test::randomBytes(dims, seed), coding);
        test::MemorySink sink(dims, 16);
        StoredCodePlanes planes(codes, dims);
        sweepAttenuation(planes, dims, 16, *segments, sink, 3, memory);
        const Planes expected = sweepAll(codes, dims, *segments);
        for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
          bool outside = false;
          EXPECT_EQ(sink.volumeOrder(direction, outside), expected[size_t(direction)]) << direction;
          EXPECT_TRUE(outside);
        }
      }
    }
  }
}

/// Steps that stay inside from p along a direction.
int stepsInside(glm::ivec3 p, glm::ivec3 dims, int direction) {
  const glm::ivec3 step(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction));
  int steps = 0;
  while (inside(p + step * (steps + 1), dims))
    ++steps;
  return steps;
}

TEST(SweepClosedForm, uniformBoxAttenuatesByPowersOfT) {
  const glm::ivec3 dims(5, 7, 11);
  const double opacity = 0.07;
  TransferFunction transfer;
  transfer.points = {{0.0, {}, opacity}};
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  const std::vector<uint16_t> codes(voxelCount(dims), 200);
  for (const auto classification : {Classification::voxel, Classification::preintegrated}) {
    const Planes planes = sweepAll(codes, dims, *makeSegmentDepth(classification, transfer, coding), 8);
    for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
      for (int z = 0; z < dims.z; ++z) {
        for (int y = 0; y < dims.y; ++y) {
          for (int x = 0; x < dims.x; ++x) {
            const int steps = stepsInside({x, y, z}, dims, direction);
            const double expected = 255.0 * std::pow(1.0 - opacity, steps);
            ASSERT_NEAR(planes[size_t(direction)][linearIndex({x, y, z}, dims)], expected, 0.5 + 0.038);
          }
        }
      }
    }
  }
}

TEST(SweepClosedForm, opaqueRowSaturatesAndEmptyOneIsClear) {
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}, {255.0, {}, 1.0}};
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  const auto segments = makeSegmentDepth(Classification::voxel, transfer, coding);
  const glm::ivec3 dims(300, 1, 2);
  const Planes opaque = sweepAll(std::vector<uint16_t>(600, 255), dims, *segments);
  const Planes empty = sweepAll(std::vector<uint16_t>(600, 0), dims, *segments);
  const auto along = size_t(shared::directionIndex(1, 0, 0));
  for (size_t x = 0; x < 300; ++x) {
    EXPECT_EQ(opaque[along][x], x == 299 ? 255 : 0);
    EXPECT_EQ(empty[along][x], 255);
  }
}

TEST(SweepClosedForm, singleOpaqueVoxelShadowsTheVoxelsBehindItOnly) {
  TransferFunction transfer;
  transfer.points = {{0.0, {}, 0.0}, {255.0, {}, 1.0}};
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  const glm::ivec3 dims(7, 9, 8), middle(3, 5, 4);
  std::vector<uint16_t> codes(voxelCount(dims));
  codes[linearIndex(middle, dims)] = 255;
  const Planes planes = sweepAll(codes, dims, *makeSegmentDepth(Classification::voxel, transfer, coding), 8);
  for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
    const glm::ivec3 step(shared::directionX(direction), shared::directionY(direction), shared::directionZ(direction));
    std::vector<uint8_t> expected(codes.size(), 255);
    for (glm::ivec3 p = middle - step; inside(p, dims); p -= step)
      expected[linearIndex(p, dims)] = 0;
    EXPECT_EQ(planes[size_t(direction)], expected) << direction;
  }
}

/// Checks the order of calls that AttenuationSink promises, and wants every other brick only.
class OrderSink final : public AttenuationSink {
 public:
  OrderSink(glm::ivec3 dims, int edge) : all_(dims, edge) {}
  std::span<const BrickPlanes> begin(int pass, int slab) override {
    EXPECT_EQ(slab, pass == 0 ? begun[0] : last() - begun[1]);
    EXPECT_EQ(begun[pass], completed[pass]);
    ++begun[pass];
    wanted_[pass].clear();
    for (const BrickPlanes& brick : all_.begin(pass, slab)) {
      if ((brick.position.x + brick.position.y) % 2 == 0) wanted_[pass].push_back(brick);
    }
    std::reverse(wanted_[pass].begin(), wanted_[pass].end());
    return wanted_[pass];
  }
  void complete(int pass, int slab) override {
    EXPECT_EQ(slab, pass == 0 ? completed[0] : last() - completed[1]);
    ++completed[pass];
  }
  static int last() { return 2; }
  int begun[kSweepPasses] = {}, completed[kSweepPasses] = {};
  const test::MemorySink& all() const { return all_; }

 private:
  test::MemorySink all_;
  std::vector<BrickPlanes> wanted_[kSweepPasses];
};

TEST(SweepOrder, aPassCompletesSlabAfterSlabAndFillsWhatIsWanted) {
  const glm::ivec3 dims(29, 23, 19);
  const TransferFunction transfer = test::veilAndRamp();
  const ValueCoding coding = valueCoding(ValueType::u8, transfer.low, transfer.high);
  const auto codes = encodeValues(test::randomBytes(dims, 15), coding);
  const auto segments = makeSegmentDepth(Classification::preintegrated, transfer, coding);
  const Planes expected = sweepAll(codes, dims, *segments, 8);
  for (const unsigned passes : {1u, 2u, 3u}) {
    OrderSink sink(dims, 8);
    StoredCodePlanes planes(codes, dims);
    sweepAttenuation(planes, dims, 8, *segments, sink, passes);
    for (int pass = 0; pass < kSweepPasses; ++pass)
      EXPECT_EQ(sink.completed[pass], (passes >> pass & 1u) != 0 ? 3 : 0);
    for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
      if ((passes >> sweepPass(direction) & 1u) == 0) continue;
      bool outside = false;
      const auto found = sink.all().volumeOrder(direction, outside);
      for (uint64_t i = 0; i < found.size(); ++i) {
        const uint64_t x = i % uint64_t(dims.x) / 8, y = i / uint64_t(dims.x) % uint64_t(dims.y) / 8;
        ASSERT_EQ(found[i], (x + y) % 2 == 0 ? expected[size_t(direction)][i] : 77);
      }
    }
  }
}

/// Wants nothing.
class NoSink final : public AttenuationSink {
 public:
  std::span<const BrickPlanes> begin(int /*pass*/, int /*slab*/) override { return {}; }
  void complete(int /*pass*/, int /*slab*/) override {}
};

/// What each part takes by itself, passed on from part to part, is what comes into the next one; and parts that start
/// from that fill their bricks as the whole does.
TEST(SweepParts, joinToTheWhole) {
  const glm::ivec3 dims(13, 29, 61);
  const int edge = 8;
  const TransferFunction transfer = test::veilAndRamp();
  for (const auto classification : {Classification::voxel, Classification::preintegrated}) {
    for (const ValueType type : {ValueType::u8, ValueType::u16}) {
      // Thin enough to reach through several parts, thick enough to saturate here and there.
      std::mt19937 random(5);
      const auto volume = test::makeVolume<uint16_t>(
          ValueType::u16, dims, [&](int, int, int) { return uint16_t(random() % 8 == 0 ? random() % 256 : 110); });
      const ValueCoding coding = valueCoding(type, transfer.low, type == ValueType::u8 ? transfer.high : 1000.0);
      const auto codes = encodeValues(volume, coding);
      const auto segments = makeSegmentDepth(classification, transfer, coding);
      const Planes expected = sweepAll(codes, dims, *segments, edge);
      StoredCodePlanes planes(codes, dims);
      const std::vector<int> cuts = {0, 1, 4, 5, 8};
      const size_t parts = cuts.size() - 1, planeVoxels = size_t(dims.x) * size_t(dims.y);
      std::vector<BorderDepths> leaving, incoming(parts);
      NoSink nothing;
      for (size_t i = 0; i < parts; ++i) {
        leaving.push_back(sweepPart(planes, dims, edge, *segments, nothing, 3u, {cuts[i], cuts[i + 1], {}, true}));
      }
      for (int pass = 0; pass < kSweepPasses; ++pass) {
        for (size_t i = 0; i + 1 < parts; ++i) {
          const size_t from = pass == 0 ? i : parts - 1 - i, to = pass == 0 ? from + 1 : from - 1;
          auto& out = leaving[from][size_t(pass)];
          const auto& in = incoming[from][size_t(pass)];
          const int length = std::min(cuts[from + 1] * edge, dims.z) - cuts[from] * edge;
          for (size_t k = 0; k < size_t(kBorderDirections) && !in.empty(); ++k) {
            addIncoming(std::span(in).subspan(k * planeVoxels, planeVoxels), borderDirection(pass, int(k)), length,
                        dims, std::span(out).subspan(k * planeVoxels, planeVoxels));
          }
          incoming[to][size_t(pass)] = out;
        }
      }
      test::MemorySink sink(dims, edge);
      for (size_t i = 0; i < parts; ++i)
        sweepPart(planes, dims, edge, *segments, sink, 3u, {cuts[i], cuts[i + 1], incoming[i], false});
      for (int direction = 0; direction < shared::kDirectionCount; ++direction) {
        bool outside = false;
        ASSERT_EQ(sink.volumeOrder(direction, outside), expected[size_t(direction)]) << direction;
      }
    }
  }
}

}  // namespace
}  // namespace freevoxel
