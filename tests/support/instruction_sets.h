// Running the same code with every instruction set. What the code under test defines before Highway's headers
// (HWY_WANT_AVX3_DL) is to be defined before this one, too.
#pragma once

#include <cstdint>
#include <vector>

#include <hwy/highway.h>

namespace freevoxel::test {

/// Chooses among the instruction sets that this machine has; undone at the end.
class InstructionSet {
 public:
  explicit InstructionSet(int64_t target) { choose(target); }
  ~InstructionSet() { choose(0); }

 private:
  static void choose(int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

inline std::vector<int64_t> instructionSets() {
  std::vector<int64_t> sets;
  for (int64_t rest = hwy::SupportedTargets() & HWY_TARGETS; rest != 0; rest &= rest - 1)
    sets.push_back(rest & -rest);
  return sets;
}

}  // namespace freevoxel::test
