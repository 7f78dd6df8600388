#include "precompute/hilbert.h"

#include <array>
#include <mutex>
#include <vector>

#include "base/error.h"
#include "base/grid.h"

namespace freevoxel {

namespace {

constexpr int kStates = kHilbertStateCount;
constexpr int kLargestBrickOrder = 5;

/// The curve as a machine that reads one octant per level (bit 0 x, bit 1 y, bit 2 z), coarsest first. State 0 starts.
struct Tables {
  std::array<std::array<uint8_t, 8>, kStates> digit{};   ///< state, octant -> place among the eight
  std::array<std::array<uint8_t, 8>, kStates> octant{};  ///< state, place -> octant
  std::array<std::array<uint8_t, 8>, kStates> next{};    ///< state, octant -> state inside that octant
  int found = 0;                                         ///< states reached from the first one
};

constexpr int gray(int i) {
  return i ^ (i >> 1);
}
constexpr int rotateLeft(int octant, int by) {
  return ((octant << by) | (octant >> (3 - by))) & 7;
}

constexpr int trailingOnes(int i) {
  int count = 0;
  for (; (i & 1) != 0; i >>= 1)
    ++count;
  return count;
}

/// Hamilton's construction (C. Hamilton, Compact Hilbert Indices, 2006, section 2): a state is the corner where the
/// curve enters and the axis along which it leaves; inside it the octants follow the Gray code, reflected and rotated.
/// Corners of even parity only are reached: 4 x 3 states.
constexpr Tables makeTables() {
  Tables tables;
  std::array<int, kStates> entries{};
  std::array<int, kStates> axes{};
  tables.found = 1;
  for (int state = 0; state < tables.found; ++state) {
    for (int place = 0; place < 8; ++place) {
      const int turn = (axes[state] + 1) % 3;
      const int octant = rotateLeft(gray(place), turn) ^ entries[state];
      const int childEntry = place == 0 ? 0 : gray(2 * ((place - 1) / 2));
      const int childAxis = place == 0 ? 0 : trailingOnes(place % 2 == 0 ? place - 1 : place) % 3;
      const int entry = entries[state] ^ rotateLeft(childEntry, turn);
      const int axis = (axes[state] + childAxis + 1) % 3;
      int child = 0;
      while (child < tables.found && (entries[child] != entry || axes[child] != axis))
        ++child;
      if (child == tables.found) {
        entries[child] = entry;  // out of bounds, and so no constant expression, if there were more states
        axes[child] = axis;
        ++tables.found;
      }
      tables.digit[state][octant] = uint8_t(place);
      tables.octant[state][place] = uint8_t(octant);
      tables.next[state][octant] = uint8_t(child);
    }
  }
  return tables;
}

constexpr Tables kTables = makeTables();
static_assert(kTables.found == kStates);

int octantOf(glm::ivec3 p, int level) {
  return (p.x >> level & 1) | (p.y >> level & 1) << 1 | (p.z >> level & 1) << 2;
}

struct LocalCurve {
  std::once_flag made;
  std::vector<LocalPosition> curve;
  std::vector<uint16_t> steps;
};

const LocalCurve& localCurve(int state, int brickOrder) {
  check(state >= 0 && state < kStates && brickOrder >= 0 && brickOrder <= kLargestBrickOrder,
        "Hilbert state and brick order are in range");
  static std::array<std::array<LocalCurve, kLargestBrickOrder + 1>, kStates> curves;
  LocalCurve& local = curves[size_t(state)][size_t(brickOrder)];
  std::call_once(local.made, [&] {
    const size_t count = size_t(1) << (3 * brickOrder);
    local.curve.resize(count);
    local.steps.resize(count);
    for (size_t step = 0; step < count; ++step) {
      glm::ivec3 p(0);
      size_t inside = size_t(state);
      for (int level = brickOrder - 1; level >= 0; --level) {
        const size_t octant = kTables.octant[inside][step >> (3 * level) & 7];
        p = p * 2 + glm::ivec3(int(octant & 1), int(octant >> 1 & 1), int(octant >> 2));
        inside = kTables.next[inside][octant];
      }
      local.curve[step] = {uint8_t(p.x), uint8_t(p.y), uint8_t(p.z)};
      local.steps[linearIndex(p, glm::ivec3(1 << brickOrder))] = uint16_t(step);
    }
  });
  return local;
}

}  // namespace

uint64_t hilbertIndex(glm::ivec3 p, int order) {
  uint64_t index = 0;
  size_t state = 0;
  for (int level = order - 1; level >= 0; --level) {
    const auto octant = size_t(octantOf(p, level));
    index = index << 3 | kTables.digit[state][octant];
    state = kTables.next[state][octant];
  }
  return index;
}

glm::ivec3 hilbertPosition(uint64_t index, int order) {
  glm::ivec3 p(0);
  size_t state = 0;
  for (int level = order - 1; level >= 0; --level) {
    const size_t octant = kTables.octant[state][index >> (3 * level) & 7];
    p = p * 2 + glm::ivec3(int(octant & 1), int(octant >> 1 & 1), int(octant >> 2));
    state = kTables.next[state][octant];
  }
  return p;
}

int hilbertOrder(glm::ivec3 dims) {
  int order = 0;
  while ((1 << order) < dims.x || (1 << order) < dims.y || (1 << order) < dims.z)
    ++order;
  return order;
}

int hilbertState(glm::ivec3 brick, int order) {
  size_t state = 0;
  for (int level = order - 1; level >= 0; --level)
    state = kTables.next[state][size_t(octantOf(brick, level))];
  return int(state);
}

std::span<const LocalPosition> hilbertCurve(int state, int brickOrder) {
  return localCurve(state, brickOrder).curve;
}

std::span<const uint16_t> hilbertSteps(int state, int brickOrder) {
  return localCurve(state, brickOrder).steps;
}

}  // namespace freevoxel
