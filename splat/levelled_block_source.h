// Blocks of the finest level from one source, of all others from another one.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "splat/block_source.h"

namespace freevoxel {

/// Both are of the same volume, edge and lighting.
class LevelledBlockSource final : public BlockSource {
 public:
  LevelledBlockSource(std::unique_ptr<BlockSource> finest, std::unique_ptr<BlockSource> coarser)
      : finest_(std::move(finest)), coarser_(std::move(coarser)) {}

  int edge() const override { return finest_->edge(); }
  glm::ivec3 dims(int level) const override { return of(level).dims(level); }
  void prepare(std::span<const VisibleBlock> blocks) override {
    std::vector<VisibleBlock> ofFinest, ofOthers;
    for (const VisibleBlock& block : blocks)
      (block.level == 0 ? ofFinest : ofOthers).push_back(block);
    finest_->prepare(ofFinest);
    coarser_->prepare(ofOthers);
  }
  void gather(const VisibleBlock& block, BlockSamples& samples) const override {
    of(block.level).gather(block, samples);
  }
  uint64_t volumeBytes() const override { return finest_->volumeBytes() + coarser_->volumeBytes(); }
  bool lit() const override { return finest_->lit(); }

 private:
  const BlockSource& of(int level) const { return level == 0 ? *finest_ : *coarser_; }

  std::unique_ptr<BlockSource> finest_, coarser_;
};

}  // namespace freevoxel
