#include "base/give_back.h"

#include <gtest/gtest.h>

namespace freevoxel {
namespace {

TEST(GiveBack, leavesNoRoomBehind) {
  std::vector<int> values(1000, 7);
  giveBack(values);
  EXPECT_TRUE(values.empty());
  EXPECT_EQ(values.capacity(), 0u);
  values.assign(5, 3);
  EXPECT_EQ(values, std::vector<int>(5, 3));
}

}  // namespace
}  // namespace freevoxel
