#include "precompute/run_order.h"

#include <algorithm>
#include <vector>

#include "base/error.h"

namespace freevoxel {

namespace {

constexpr int kRunOrder = 2;
constexpr int kSmallestBrickOrder = 2;
constexpr int kLargestBrickOrder = 5;

std::array<RunOrder, kHilbertStateCount> makeRunOrders() {
  std::array<RunOrder, kHilbertStateCount> orders{};
  for (int state = 0; state < kHilbertStateCount; ++state) {
    RunOrder& order = orders[size_t(state)];
    const auto curve = hilbertCurve(state, kRunOrder);
    for (size_t step = 0; step < kRunVoxels; ++step) {
      const LocalPosition p = curve[step];
      order.source[step] = uint8_t(p.x + 4 * (p.y + 4 * p.z));
      order.octants[step / 8] = uint8_t((p.y / 2) * 2 + p.x / 2 + 4 * (p.z / 2));
      order.within[step] = uint8_t(step / 8 % 2 * 8 + (p.x & 1u) + 2 * (p.y & 1u) + 4 * (p.z & 1u));
    }
  }
  return orders;
}

/// The state whose curve visits the 64 voxels in the order that `steps` gives, less their first step.
int stateOf(const std::array<uint16_t, kRunVoxels>& steps) {
  for (int state = 0; state < kHilbertStateCount; ++state) {
    const auto candidate = hilbertSteps(state, kRunOrder);
    if (std::equal(steps.begin(), steps.end(), candidate.begin())) return state;
  }
  throw InternalError("a run of the Hilbert curve is a Hilbert curve");
}

std::vector<BrickRun> makeBrickRuns(int state, int brickOrder) {
  const int edge = 1 << brickOrder;
  const int runs = edge / kRunEdge;
  const auto steps = hilbertSteps(state, brickOrder);
  std::vector<BrickRun> result;
  for (int run = 0; run < runs * runs * runs; ++run) {
    const int x = run % runs * kRunEdge, y = run / runs % runs * kRunEdge, z = run / (runs * runs) * kRunEdge;
    std::array<uint16_t, kRunVoxels> own{};
    for (int i = 0; i < kRunVoxels; ++i)
      own[size_t(i)] = steps[size_t((x + i % 4) + edge * ((y + i / 4 % 4) + edge * (z + i / 16)))];
    const uint16_t first = *std::min_element(own.begin(), own.end());
    for (uint16_t& step : own)
      step = uint16_t(step - first);
    result.push_back({first, &runOrder(stateOf(own))});
  }
  return result;
}

}  // namespace

const RunOrder& runOrder(int state) {
  static const std::array<RunOrder, kHilbertStateCount> orders = makeRunOrders();
  return orders[size_t(state)];
}

std::span<const BrickRun> brickRuns(int state, int brickOrder) {
  check(
      state >= 0 && state < kHilbertStateCount && brickOrder >= kSmallestBrickOrder && brickOrder <= kLargestBrickOrder,
      "Hilbert state and brick order are in range");
  using Runs = std::array<std::vector<BrickRun>, kHilbertStateCount>;
  static const std::array<Runs, kLargestBrickOrder + 1> all = [] {
    std::array<Runs, kLargestBrickOrder + 1> made;
    for (int order = kSmallestBrickOrder; order <= kLargestBrickOrder; ++order) {
      for (int s = 0; s < kHilbertStateCount; ++s)
        made[size_t(order)][size_t(s)] = makeBrickRuns(s, order);
    }
    return made;
  }();
  return all[size_t(brickOrder)][size_t(state)];
}

}  // namespace freevoxel
