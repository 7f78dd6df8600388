// What processes that precompute one volume together need of each other. precompute/ does not know how they talk:
// parallel/distributed_precompute.h implements this over MPI.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace freevoxel {

/// Each process (rank) has the slabs of bricks after those of the rank below it. Every call but send and receive is
/// collective. What a rank throws between two calls of agree() must not keep another one waiting: exchanges follow an
/// agree() and need no more memory than the rank has.
class SlabTeam {
 public:
  virtual ~SlabTeam() = default;
  virtual int rank() const = 0;
  virtual int rankCount() const = 0;
  /// Ends, by an exception, the work of a rank that is well if another one has failed.
  virtual void agree() = 0;
  /// Everybody's bytes, by rank.
  virtual std::vector<std::string> gatherEverywhere(const std::string& mine) = 0;
  virtual void send(int toRank, std::span<const std::byte> bytes) = 0;
  virtual void receive(int fromRank, std::span<std::byte> bytes) = 0;
};

}  // namespace freevoxel
