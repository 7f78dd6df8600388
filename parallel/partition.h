// Which rank draws which block (papers/freevoxels section 4.4; DESIGN section 9). Pure functions: every rank computes
// the whole map by itself and comes to the same.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace freevoxel {

/// How blocks are dealt to ranks. It changes no bit of the picture, only who works how long.
struct Partition {
  enum class Kind {
    roundRobin,  ///< one by one in turn, those with most work first, back and forth: 0 1 2 2 1 0 0 1 2, so that
                 ///< nobody always has the largest
    hilbert,     ///< runs of the Hilbert curve, as many blocks for each rank
    slab,        ///< slabs across z, as many blocks for each rank
    random,      ///< every block to a rank drawn at random
    file,        ///< as a text file says
  } kind = Kind::roundRobin;
  uint64_t seed = 0;  ///< of random
  std::string path;   ///< of file: one rank per block, in the order of the curve, separated by white space
};

/// What of a block decides who gets it.
struct SharedBlock {
  int level = 0;      ///< blocks of each level are dealt by themselves
  int z = 0;          ///< of its first voxel
  uint64_t work = 0;  ///< what drawing it costs, in any unit
};

/// "round-robin", "hilbert", "slab", "random:SEED", "file:F"; nothing else is accepted: returns false.
bool parsePartition(std::string_view text, Partition& partition);
std::string partitionName(const Partition& partition);

/// For each of `blocks`, which are sorted along the Hilbert curve within each level, the rank that draws it: 0 to
/// rankCount - 1. Throws InputError if a file has too few or too many numbers, or one that is no rank.
std::vector<int> dealBlocks(std::span<const SharedBlock> blocks, const Partition& partition, int rankCount);

/// 1 for every block of `owners` that is `rank`'s, else 0.
std::vector<uint8_t> shareOf(std::span<const int> owners, int rank);

/// Mean over largest of what the ranks have to do, 0..1: the efficiency that the distribution allows. 1 if there is
/// nothing to do.
double balance(std::span<const uint64_t> workOfRanks);

}  // namespace freevoxel
