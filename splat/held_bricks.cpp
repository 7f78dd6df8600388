#include "splat/held_bricks.h"

#include <algorithm>
#include <utility>

namespace freevoxel {

namespace {

template <class T>
uint64_t bytesOf(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

}  // namespace

uint64_t HeldBrick::bytes() const {
  uint64_t sum = bytesOf(codes) + bytesOf(matter) + bytesOf(cover) + bytesOf(attenuations) + bytesOf(lights);
  for (const std::vector<uint16_t>& towards : far)
    sum += bytesOf(towards);
  return sum;
}

HeldBrick& HeldBricks::use(uint64_t number) {
  HeldBrick& brick = bricks_[number];
  brick.lastUsed = call_;
  return brick;
}

const HeldBrick* HeldBricks::find(uint64_t number) const {
  const auto found = bricks_.find(number);
  return found == bricks_.end() ? nullptr : &found->second;
}

void HeldBricks::forget(uint64_t bytes) {
  if (bytes_ <= bytes) return;
  std::vector<std::pair<uint64_t, uint64_t>> old;  // when last used, and which
  for (const auto& [number, brick] : bricks_) {
    if (brick.lastUsed != call_) old.emplace_back(brick.lastUsed, number);
  }
  std::sort(old.begin(), old.end());
  for (const auto& [used, number] : old) {
    if (bytes_ <= bytes) return;
    const auto found = bricks_.find(number);
    bytes_ -= found->second.bytes();
    bricks_.erase(found);
  }
}

void HeldBricks::clear() {
  bricks_.clear();
  bytes_ = 0;
}

}  // namespace freevoxel
